//! Parts of the surface of a cylinder: of a fine prism with edges on its round side.
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::base::elementary;
use crate::collide::scene::cylinder::Cylinder;

/// Number of sectors of a turn. A side of the prism is one or more of them.
const SECTORS: u32 = 1 << 15;

/// How many sectors a side of the prism has: a power of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side(u32);

impl Side {
    /// The largest side whose middle is within a sixteenth of the tolerance of the round side, or a
    /// sector. A prism of sectors takes 30 times as long as one for the tolerances of the dynamics.
    pub fn within(tolerance: f64, radius: f64) -> Self {
        // 1 - cos x ≤ x² / 2
        let sides = PI * (8.0 * radius / tolerance).sqrt();
        let mut side = 1;
        while f64::from(SECTORS / (2 * side)) >= sides.max(8.0) {
            side *= 2;
        }
        Self(side)
    }

    /// The surface lies within this share of the radius of the prism.
    pub fn beside(self) -> f64 {
        let half_angle = PI * f64::from(self.0) / f64::from(SECTORS);
        0.5 * half_angle * half_angle * (1.0 + 1e-9)
    }
}

/// What is between some neighbouring edges of the prism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CylinderPart {
    kind: Kind,
    /// The first edge, and the number of sectors up to the last one, a power of two.
    first: u32,
    count: u32,
    side: Side,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Of each side of the prism, one of its two triangles.
    Round { is_upper: bool },
    /// Of an end, what is between the first and the last edge and the rim.
    Segment { is_high: bool },
    /// The triangle of the first, the middle and the last edge of a segment.
    Triangle { is_high: bool },
}

impl CylinderPart {
    /// The round side and the two ends of a prism.
    pub fn all(side: Side) -> Vec<Self> {
        let all = |kind| Self { kind, first: 0, count: SECTORS, side };
        let rounds = [false, true].map(|is_upper| all(Kind::Round { is_upper }));
        let ends = [false, true].map(|is_high| all(Kind::Segment { is_high }).halves());
        [rounds, ends[0], ends[1]].concat()
    }

    fn halves(self) -> [Self; 2] {
        let count = self.count / 2;
        [self.first, self.first + count].map(|first| Self { first, count, ..self })
    }

    /// Whether it is flat and has no parts.
    pub fn is_face(&self) -> bool {
        match self.kind {
            Kind::Round { .. } => self.count == self.side.0,
            Kind::Segment { .. } => false,
            Kind::Triangle { .. } => true,
        }
    }

    /// What it consists of; nothing of a face.
    pub fn parts(&self) -> Vec<Self> {
        match self.kind {
            _ if self.is_face() => Vec::new(),
            Kind::Round { .. } => self.halves().into(),
            Kind::Segment { is_high } | Kind::Triangle { is_high } => {
                let mut parts = vec![Self { kind: Kind::Triangle { is_high }, ..*self }];
                // The segment of one side has no area.
                if self.count > 2 * self.side.0 {
                    parts.extend(self.halves());
                }
                parts
            }
        }
    }

    /// The corners of a face.
    pub fn corners(&self, cylinder: &Cylinder) -> [DVec3; 3] {
        let Cylinder { half_height: h, radius } = *cylinder;
        let edge = |k: u32| radius * direction(f64::from(k));
        let [from, to] = [self.first, self.first + self.count].map(edge);
        match self.kind {
            Kind::Round { is_upper: false } => [from.extend(-h), to.extend(-h), to.extend(h)],
            Kind::Round { is_upper: true } => [from.extend(-h), to.extend(h), from.extend(h)],
            Kind::Segment { is_high } | Kind::Triangle { is_high } => {
                let z = if is_high { h } else { -h };
                [from, edge(self.first + self.count / 2), to].map(|p| p.extend(z))
            }
        }
    }

    /// A box that holds the part: its middle, and the ways from there to its sides.
    pub fn bounds(&self, cylinder: &Cylinder) -> (DVec3, [DVec3; 3]) {
        // Rounding, of lengths that are about as large as the radius.
        const MORE: f64 = 4e-15;
        let Cylinder { half_height: h, radius } = *cylinder;
        let middle = direction(f64::from(self.first) + 0.5 * f64::from(self.count));
        let half_angle = PI * f64::from(self.count) / f64::from(SECTORS);
        // The part reaches from `near` to the radius along the middle direction, and `aside`.
        let (near, aside) = (elementary::cos(half_angle), elementary::sin(half_angle.min(0.5 * PI)));
        let (low, high) = match self.kind {
            Kind::Round { .. } => (-h, h),
            Kind::Segment { is_high: false } | Kind::Triangle { is_high: false } => (-h, -h),
            Kind::Segment { is_high: true } | Kind::Triangle { is_high: true } => (h, h),
        };
        let center = (0.5 * (1.0 + near) * radius * middle).extend(0.5 * (low + high));
        let along = (0.5 * (1.0 - near) + MORE) * radius;
        let across = (aside + MORE) * radius;
        let halves = [
            (along * middle).extend(0.0),
            (across * middle.perp()).extend(0.0),
            // Not zero, so that the axis of an end is known.
            DVec3::new(0.0, 0.0, 0.5 * (high - low) + MORE * radius),
        ];
        (center, halves)
    }
}

/// The direction of an edge, or between edges.
fn direction(edge: f64) -> DVec2 {
    elementary::from_angle(TAU * edge / f64::from(SECTORS))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYLINDER: Cylinder = Cylinder { half_height: 0.7, radius: 1.3 };

    const SIDES: [Side; 3] = [Side(1), Side(16), Side(1 << 12)];

    #[test]
    fn sides_follow_the_tolerance() {
        for tolerance in [1e-15, 1e-9, 1e-7, 1e-5, 1e-3, 1.0, 1e3] {
            let side = Side::within(tolerance, 0.3);
            let half_angle = PI * f64::from(side.0) / f64::from(SECTORS);
            assert!(1.0 - half_angle.cos() <= side.beside());
            assert!(side == Side(1) || 0.3 * side.beside() <= tolerance / 16.0 * (1.0 + 1e-8));
            // The next larger one would not do, but for the largest.
            assert!(side == Side(1 << 12) || 0.3 * Side(2 * side.0).beside() > tolerance / 16.0);
        }
        assert_eq!([1e-15, 1e3].map(|tolerance| Side::within(tolerance, 0.3)), [Side(1), Side(1 << 12)]);
    }

    #[test]
    fn boxes_hold_the_faces_of_their_parts() {
        let mut faces = 0;
        // A part, and the boxes around it. Of most, the first parts alone are followed.
        let all = SIDES.into_iter().flat_map(CylinderPart::all);
        let mut open: Vec<_> = all.map(|part| (part, Vec::new())).collect();
        while let Some((part, mut around)) = open.pop() {
            around.push(part.bounds(&CYLINDER));
            if part.is_face() {
                faces += 1;
                for (corner, (center, halves)) in
                    part.corners(&CYLINDER).iter().flat_map(|corner| around.iter().map(move |b| (corner, b)))
                {
                    let way = *corner - *center;
                    let is_within = |half: &DVec3| way.dot(half.normalize_or_zero()).abs() <= half.length();
                    assert!(
                        halves.iter().all(is_within),
                        "{part:?}: {corner} is outside of {center} {halves:?}"
                    );
                }
            }
            let most = if around.len() < 8 { 3 } else { 2 };
            open.extend(part.parts().into_iter().take(most).map(|part| (part, around.clone())));
        }
        assert!(faces > 1000, "{faces}");
    }

    #[test]
    fn parts_add_up_to_the_area() {
        SIDES.into_iter().for_each(assert_area);
    }

    fn assert_area(side: Side) {
        let (mut open, mut area) = (CylinderPart::all(side), [0.0; 2]);
        while let Some(part) = open.pop() {
            if part.is_face() {
                let [a, b, c] = part.corners(&CYLINDER);
                let is_end = !matches!(part.kind, Kind::Round { .. });
                area[usize::from(is_end)] += 0.5 * (b - a).cross(c - a).length();
            }
            open.extend(part.parts());
        }
        let Cylinder { half_height, radius } = CYLINDER;
        let expected = [TAU * radius * 2.0 * half_height, TAU * radius * radius];
        for (area, expected) in area.into_iter().zip(expected) {
            let error = (area - expected) / expected;
            assert!(error.abs() < 6.0 * side.beside(), "{area} instead of {expected}");
        }
    }
}
