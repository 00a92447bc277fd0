//! Poses in place of translations and rotations.
use std::fmt;

use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tesdf::collide::Pose;

use super::SceneFile;

/// A pose: translation and unit quaternion, x y z qx qy qz qw, as they are given, or those of a
/// matrix of 4 × 4, which is read from its rows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseSection([f64; 7]);

/// A number or a row of a matrix.
enum Entry {
    Number(f64),
    Row([f64; 4]),
}

impl<'de> Deserialize<'de> for PoseSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;

        impl<'de> Visitor<'de> for Entries {
            type Value = PoseSection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an array of length 7")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut entries: A) -> Result<PoseSection, A::Error> {
                let (mut numbers, mut rows) = (Vec::new(), Vec::new());
                while let Some(entry) = entries.next_element()? {
                    match entry {
                        Entry::Number(number) => numbers.push(number),
                        Entry::Row(row) => rows.push(row),
                    }
                    if numbers.len() + rows.len() > 7 {
                        break;
                    }
                }
                match (numbers.len(), rows.len()) {
                    (7, 0) => Ok(PoseSection(std::array::from_fn(|k| numbers[k]))),
                    (0, 4) => {
                        let matrix = std::array::from_fn(|k| rows[k / 4][k % 4]);
                        Pose::from_matrix(&matrix).map(PoseSection::from).map_err(Error::custom)
                    }
                    (numbers, rows) => Err(Error::custom(format!(
                        "a pose of {numbers} numbers and {rows} rows; expected 7 numbers, x y z qx qy qz qw, or 4 rows of 4"
                    ))),
                }
            }
        }

        deserializer.deserialize_seq(Entries)
    }
}

impl<'de> Deserialize<'de> for Entry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrRow;

        impl<'de> Visitor<'de> for NumberOrRow {
            type Value = Entry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("f64")
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Entry, E> {
                Ok(Entry::Number(number))
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<Entry, E> {
                Ok(Entry::Number(number as f64))
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Entry, E> {
                Ok(Entry::Number(number as f64))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<Entry, A::Error> {
                let mut row = Vec::new();
                while let Some(number) = numbers.next_element::<f64>()? {
                    row.push(number);
                    if row.len() > 4 {
                        break;
                    }
                }
                let row = row.try_into().map_err(|row: Vec<f64>| {
                    Error::custom(format!("a row of {} numbers; expected 4", row.len()))
                })?;
                Ok(Entry::Row(row))
            }
        }

        deserializer.deserialize_any(NumberOrRow)
    }
}

impl From<Pose> for PoseSection {
    fn from(Pose { translation, rotation }: Pose) -> Self {
        let ([x, y, z], [i, j, k, w]) = (translation.to_array(), rotation.to_array());
        Self([x, y, z, i, j, k, w])
    }
}

/// Puts translations and rotations in place of poses.
pub(super) fn place_all(scene: &mut SceneFile) {
    for body in &mut scene.bodies {
        let body = body.as_mut();
        place(&mut body.pose, &mut body.translation, &mut body.rotation);
        if let Some(copies) = &mut body.copies {
            place(&mut copies.pose, &mut copies.translation, &mut copies.rotation);
        }
        for part in &mut body.parts {
            place(&mut part.pose, &mut part.translation, &mut part.rotation);
        }
    }
    for robot in &mut scene.robots {
        place(&mut robot.pose, &mut robot.translation, &mut robot.rotation);
    }
}

fn place(pose: &mut Option<PoseSection>, translation: &mut [f64; 3], rotation: &mut [f64; 4]) {
    if let Some(PoseSection([x, y, z, i, j, k, w])) = pose.take() {
        (*translation, *rotation) = ([x, y, z], [i, j, k, w]);
    }
}

/// What has a pose and a translation or a rotation as well in a scene with the keys of a scene file.
///
/// # Errors
/// A message, with the place.
pub(super) fn check(scene: &Value) -> Result<(), String> {
    let of = |key: &str| scene.get(key).and_then(Value::as_array).into_iter().flatten().enumerate();
    for (k, body) in of("bodies") {
        let at = format!("bodies: entry {k}");
        one_of(body, &at)?;
        one_of(&body["copies"], &format!("{at}: copies"))?;
        for part in body.get("parts").and_then(Value::as_array).into_iter().flatten() {
            one_of(part, &format!("{at}: parts"))?;
        }
    }
    for (k, robot) in of("robots") {
        one_of(robot, &format!("robots: entry {k}"))?;
    }
    Ok(())
}

fn one_of(table: &Value, at: &str) -> Result<(), String> {
    let has = |key: &str| table.get(key).is_some_and(|value| !value.is_null());
    match ["translation", "rotation"].into_iter().find(|key| has(key)) {
        Some(key) if has("pose") => Err(format!("{at}: pose beside {key}; expected one of them")),
        _ => Ok(()),
    }
}
