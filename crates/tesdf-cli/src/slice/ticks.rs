//! Round steps and labels of axes.
pub use tesdf_playback::round_step;

/// Formats `value` with the decimals that a multiple of `step` needs, and with a true minus sign.
pub fn label(value: f64, step: f64) -> String {
    let text = if value == 0.0 {
        "0".to_string()
    } else if (0.99e-4..1e5).contains(&step) {
        let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).max(0.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.1e}").replace(".0e", "e")
    };
    text.replace('-', "−")
}

/// Formats `value` with at most four significant digits, for titles.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs().log10().floor();
    let text = if (-4.0..6.0).contains(&magnitude) {
        let decimals = (3.0 - magnitude).max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        match text.contains('.') {
            true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
            false => text,
        }
    } else {
        format!("{value:.3e}")
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_and_labels_are_round() {
        for (range, step, text) in [
            (10.0, 1.0, "3"),
            (0.9, 0.05, "0.15"),
            (30.0, 2.0, "6"),
            (7e-7, 5e-8, "1.5e−7"),
            (2e7, 2e6, "6e6"),
        ] {
            let found = round_step(range, 10.0);
            assert!((found / step - 1.0).abs() < 1e-9, "{range}: {found}");
            assert_eq!(label(3.0 * found, found), text);
        }
        assert_eq!([label(-0.5, 0.5), label(0.0, 1e-9), label(1e-3, 5e-4)], ["−0.5", "0", "0.0010"]);
        assert_eq!(
            [0.0, 12.3456, -3.0, 1234567.0, 2e-9].map(short),
            ["0", "12.35", "−3", "1.235e6", "2.000e−9"]
        );
    }
}
