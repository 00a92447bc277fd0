//! Bodies on the command line.
use std::path::PathBuf;

use tesdf::collide::Shape;
use tesdf::glam::DVec3;

use crate::terminal::asset_file::{Assets, check_units};
use crate::terminal::parse;
use crate::terminal::report::Failure;

/// Geometry of a body: a file or a simple shape.
#[derive(Clone, Debug)]
pub enum BodyName {
    /// A .tesdf file.
    File(PathBuf),
    /// A plane, box, sphere, capsule or cylinder.
    Simple(Shape),
}

/// Parses `plane`, `box:HX,HY,HZ`, `sphere:R`, `capsule:HALF_HEIGHT,R` or
/// `cylinder:HALF_HEIGHT,R`. Any other text is the name of a file.
///
/// # Errors
/// The message names the number at fault.
pub fn body_name(text: &str) -> Result<BodyName, String> {
    let shape = match text.split_once(':') {
        None if text == "plane" => Shape::Plane,
        Some(("box", sizes)) => {
            Shape::Box { half_extents: DVec3::from_array(parse::numbers(sizes, "three, box:HX,HY,HZ")?) }
        }
        Some(("sphere", sizes)) => {
            let [radius] = parse::numbers(sizes, "one, sphere:R")?;
            Shape::Sphere { radius }
        }
        Some(("capsule", sizes)) => {
            let [half_height, radius] = parse::numbers(sizes, "two, capsule:HALF_HEIGHT,R")?;
            Shape::Capsule { half_height, radius }
        }
        Some(("cylinder", sizes)) => {
            let [half_height, radius] = parse::numbers(sizes, "two, cylinder:HALF_HEIGHT,R")?;
            Shape::Cylinder { half_height, radius }
        }
        _ => return parse::stream(text.into(), "/dev/stdin").map(BodyName::File),
    };
    shape.validate().map_err(|e| e.to_string())?;
    Ok(BodyName::Simple(shape))
}

/// The shapes of the bodies. A file that is named twice is opened once.
///
/// # Errors
/// A file cannot be opened, or the units differ.
pub fn open(names: &[BodyName]) -> Result<Vec<Shape>, Failure> {
    let mut assets = Assets::default();
    let shape = |name: &BodyName| match name {
        BodyName::Simple(shape) => Ok(shape.clone()),
        BodyName::File(path) => assets.open(path).map(Shape::Mesh),
    };
    let shapes: Vec<Shape> = names.iter().map(shape).collect::<Result<_, _>>()?;
    check_units(names.iter().zip(&shapes).filter_map(|(name, shape)| match (name, shape) {
        (BodyName::File(path), Shape::Mesh(asset)) => Some((path.as_path(), &**asset)),
        _ => None,
    }))?;
    Ok(shapes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_shapes_and_files() {
        let simple = |text| match body_name(text) {
            Ok(BodyName::Simple(shape)) => format!("{shape:?}"),
            other => format!("{other:?}"),
        };
        assert_eq!(simple("plane"), "Plane");
        assert_eq!(simple("sphere:0.5"), "Sphere { radius: 0.5 }");
        assert_eq!(simple("capsule:2 1"), "Capsule { half_height: 2.0, radius: 1.0 }");
        assert_eq!(simple("cylinder:2,1"), "Cylinder { half_height: 2.0, radius: 1.0 }");
        assert_eq!(simple("box:1,2,3"), "Box { half_extents: DVec3(1.0, 2.0, 3.0) }");
        assert_eq!(simple("a/b.tesdf"), "Ok(File(\"a/b.tesdf\"))");
        assert_eq!(body_name("box:1,2").unwrap_err(), "2 numbers; expected three, box:HX,HY,HZ");
        assert!(body_name("sphere:-1").unwrap_err().contains("radius -1"));
    }
}
