//! Curves as an SVG picture.
use std::fmt::Write as _;

/// How a value becomes a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// From 0 to the greatest value.
    Linear,
    /// From this value to the greatest one; smaller values stand on the axis.
    Logarithmic(f64),
}

/// A curve, and its name.
pub struct Curve {
    pub name: String,
    pub points: Vec<[f64; 2]>,
}

/// Curves over two axes.
pub struct Plot {
    /// What the axes show, with units.
    pub axes: [&'static str; 2],
    pub scale: Scale,
    /// The ticks of the horizontal axis.
    pub ticks: Vec<f64>,
    pub curves: Vec<Curve>,
}

const SIZE: [f64; 2] = [760.0, 420.0];
/// Left, top, right and bottom of the area of the curves.
const AREA: [f64; 4] = [70.0, 20.0, 520.0, 370.0];
/// Colours that people with any colour vision can tell apart (Okabe and Ito), then again with
/// dashes.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

impl Plot {
    /// The picture.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let [left, top, right, bottom] = AREA;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n\
             <rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#555\"/>\n",
            right - left,
            bottom - top
        );
        let mut text = |x: f64, y: f64, anchor: &str, words: &str| {
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>");
        };
        for &tick in &self.ticks {
            text(self.x(tick), bottom + 18.0, "middle", &tick.to_string());
        }
        for tick in self.levels() {
            text(left - 6.0, self.y(tick) + 4.0, "end", &tick.to_string());
        }
        text(0.5 * (left + right), height - 12.0, "middle", self.axes[0]);
        text(left - 50.0, top - 6.0, "start", self.axes[1]);
        for tick in self.levels() {
            let y = self.y(tick);
            let _ = writeln!(
                svg,
                "<line x1=\"{left}\" x2=\"{right}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>"
            );
        }
        for (k, curve) in self.curves.iter().enumerate() {
            let colour = COLOURS[k % COLOURS.len()];
            let dashes = if k < COLOURS.len() { "" } else { " stroke-dasharray=\"6 4\"" };
            let style = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dashes}");
            let points: Vec<String> =
                curve.points.iter().map(|&[x, y]| format!("{:.1},{:.1}", self.x(x), self.y(y))).collect();
            let (x, y) = (right + 12.0, top + 12.0 + 20.0 * k as f64);
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" {style}/>\n\
                 <line x1=\"{x}\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\" {style}/>\n\
                 <text x=\"{}\" y=\"{}\">{}</text>",
                points.join(" "),
                x + 26.0,
                x + 32.0,
                y + 4.0,
                curve.name
            );
        }
        svg + "</svg>\n"
    }

    fn greatest(&self, axis: usize) -> f64 {
        let values = self.curves.iter().flat_map(|curve| &curve.points).map(|point| point[axis]);
        values.fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Heights with a line.
    fn levels(&self) -> Vec<f64> {
        match self.scale {
            Scale::Linear => {
                let greatest = self.greatest(1);
                let decade = 10f64.powf(greatest.log10().floor());
                let steps = [0.2, 0.5, 1.0, 2.0].map(|s| s * decade);
                let step = steps.into_iter().find(|s| greatest / s <= 6.0).unwrap_or(decade);
                let count = (greatest / step) as i32;
                // Rounded, because 3 × 0.2 is not 0.6.
                (0..=count).map(|k| (f64::from(k) * step * 1e6).round() / 1e6).collect()
            }
            Scale::Logarithmic(least) => {
                let decades = (self.greatest(1) / least).log10().floor() as i32;
                (0..=decades).map(|k| least * 10f64.powi(k)).map(|v| (v * 1e6).round() / 1e6).collect()
            }
        }
    }

    fn x(&self, value: f64) -> f64 {
        let [left, _, right, _] = AREA;
        let least = self.ticks.first().copied().unwrap_or(0.0);
        left + (value - least) / (self.greatest(0) - least).max(f64::MIN_POSITIVE) * (right - left)
    }

    fn y(&self, value: f64) -> f64 {
        let [_, top, _, bottom] = AREA;
        let share = match self.scale {
            Scale::Linear => value / self.greatest(1),
            Scale::Logarithmic(least) => (value.max(least) / least).ln() / (self.greatest(1) / least).ln(),
        };
        bottom - share * (bottom - top - 12.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_below_a_logarithmic_axis_stand_on_it_and_decades_are_as_high() {
        let curve = Curve { name: "fall".into(), points: vec![[0.0, 1000.0], [1.0, 10.0], [2.0, 0.0]] };
        let ticks = vec![0.0, 1.0, 2.0];
        let plot =
            Plot { axes: ["frame", "µm"], scale: Scale::Logarithmic(0.1), ticks, curves: vec![curve] };
        assert_eq!(plot.levels(), [0.1, 1.0, 10.0, 100.0, 1000.0]);
        assert!(plot.svg().contains("points=\"70.0,32.0 295.0,201.0 520.0,370.0\""), "{}", plot.svg());
    }

    #[test]
    fn a_linear_axis_has_round_steps() {
        let curve = Curve { name: "time".into(), points: vec![[32.0, 0.3], [64.0, 0.7]] };
        let plot = Plot { axes: ["", ""], scale: Scale::Linear, ticks: vec![32.0], curves: vec![curve] };
        assert_eq!(plot.levels(), [0.0, 0.2, 0.4, 0.6]);
    }
}
