//! Finds the meshes that the build items show, with their poses.
use std::collections::{HashMap, HashSet};

use glam::DAffine3;

use super::model::{Component, Model, Shape};
use super::{ReadError, fault};

/// Largest number of vertices, of face corners, and of places of objects, of all instances
/// together. A file of some kilobytes can show a mesh any number of times.
const MAX_ELEMENTS: u64 = 1 << 27;

/// A mesh at a place.
pub(super) struct Instance {
    pub model: usize,
    pub object: usize,
    pub name: String,
    pub pose: DAffine3,
}

/// An object: the index of its model, and its index there.
type Id = (usize, usize);

/// All meshes that are shown, in the order of the items. `models[0]` has the build items.
pub(super) fn instances(models: &[Model], notes: &mut Vec<String>) -> Result<Vec<Instance>, ReadError> {
    let index = Index::new(models)?;
    let order = index.order()?;
    let mut roots = Vec::new();
    let mut supports = 0;
    for (i, item) in models[0].items.iter().enumerate() {
        let id = index.find(0, item, || format!("{}, build item {i} (0-based)", models[0].part))?;
        if models[id.0].objects[id.1].is_support {
            supports += 1;
        } else {
            roots.push((id, item.pose, None));
        }
    }
    if supports > 0 {
        notes.push(format!("{supports} build items are supports, which were left out"));
    }
    if models[0].items.is_empty() {
        let shown: HashSet<Id> = index.children.values().flatten().map(|(id, _)| *id).collect();
        let alone = (0..models[0].objects.len()).map(|object| (0, object)).filter(|id| !shown.contains(id));
        roots.extend(alone.map(|id| (id, DAffine3::IDENTITY, None)));
        if !roots.is_empty() {
            notes.push("the file has no build items; all objects were read".into());
        }
    }
    index.limit(&order, roots.iter().map(|&(id, ..)| id))?;

    let mut found = Vec::new();
    let mut stack: Vec<(Id, DAffine3, Option<&str>)> = roots.into_iter().rev().collect();
    while let Some((id, pose, above)) = stack.pop() {
        let object = &models[id.0].objects[id.1];
        let name = object.name.as_deref().or(above);
        if let Shape::Mesh { triangles, .. } = &object.shape {
            let size = pose.matrix3.determinant();
            if size == 0.0 || !size.is_finite() {
                let found = format!("the determinant of all transforms together is {size}");
                return Err(fault(object.place(), found, "expected one that keeps the mesh a volume"));
            }
            if !triangles.is_empty() {
                let name = name.map_or_else(|| format!("object {}", object.id), str::to_owned);
                found.push(Instance { model: id.0, object: id.1, name, pose });
            }
        }
        let below = index.children.get(&id).into_iter().flatten().rev();
        stack.extend(below.map(|&(child, local)| (child, pose * local, name)));
    }
    Ok(found)
}

struct Index<'a> {
    models: &'a [Model],
    by_id: HashMap<(usize, u32), usize>,
    children: HashMap<Id, Vec<(Id, DAffine3)>>,
}

impl<'a> Index<'a> {
    fn new(models: &'a [Model]) -> Result<Self, ReadError> {
        let mut index = Self { models, by_id: HashMap::new(), children: HashMap::new() };
        for (m, model) in models.iter().enumerate() {
            for (o, object) in model.objects.iter().enumerate() {
                if index.by_id.insert((m, object.id), o).is_some() {
                    let found = "two objects have this id";
                    return Err(fault(object.place(), found, "expected one: export the file again"));
                }
            }
        }
        for (m, model) in models.iter().enumerate() {
            for (o, object) in model.objects.iter().enumerate() {
                let Shape::Components(components) = &object.shape else { continue };
                let children = components
                    .iter()
                    .map(|component| Ok((index.find(m, component, || object.place())?, component.pose)))
                    .collect::<Result<_, ReadError>>()?;
                index.children.insert((m, o), children);
            }
        }
        Ok(index)
    }

    /// The object that a component of model `from` shows.
    fn find(&self, from: usize, component: &Component, place: impl Fn() -> String) -> Result<Id, ReadError> {
        let model = match &component.part {
            None => Some(from),
            Some(part) => self.models.iter().position(|model| model.part == *part),
        };
        let object = model.and_then(|model| Some((model, *self.by_id.get(&(model, component.object))?)));
        object.ok_or_else(|| {
            let found = format!("it shows object {}, which does not exist", component.object);
            fault(place(), found, "expected the id of an object: export the file again")
        })
    }

    /// All objects, each after those that it shows.
    fn order(&self) -> Result<Vec<Id>, ReadError> {
        let all = || {
            self.models
                .iter()
                .enumerate()
                .flat_map(|(m, model)| (0..model.objects.len()).map(move |o| (m, o)))
        };
        let mut open: HashMap<Id, usize> = HashMap::new();
        let mut parents: HashMap<Id, Vec<Id>> = HashMap::new();
        for id in all() {
            let children = self.children.get(&id).map_or(&[][..], Vec::as_slice);
            open.insert(id, children.len());
            children.iter().for_each(|&(child, _)| parents.entry(child).or_default().push(id));
        }
        let mut order: Vec<Id> = all().filter(|id| open[id] == 0).collect();
        let mut next = 0;
        while let Some(&id) = order.get(next) {
            next += 1;
            for parent in parents.get(&id).into_iter().flatten() {
                let left = open.entry(*parent).or_default();
                *left -= 1;
                if *left == 0 {
                    order.push(*parent);
                }
            }
        }
        match all().find(|id| open[id] > 0) {
            None => Ok(order),
            Some((m, o)) => {
                let place = self.models[m].objects[o].place();
                Err(fault(
                    place,
                    "the object shows itself",
                    "components must form trees: export the file again",
                ))
            }
        }
    }

    /// Refuses a scene with too many elements. They are counted before anything is copied.
    fn limit(&self, order: &[Id], roots: impl Iterator<Item = Id>) -> Result<(), ReadError> {
        let mut sums: HashMap<Id, [u64; 3]> = HashMap::new();
        for &id in order {
            let own = match &self.models[id.0].objects[id.1].shape {
                Shape::Mesh { positions, triangles } => {
                    [1, positions.len() as u64, 3 * triangles.len() as u64]
                }
                Shape::Components(_) => [1, 0, 0],
            };
            let below = self.children.get(&id).into_iter().flatten();
            sums.insert(id, below.fold(own, |sum, (child, _)| add(sum, sums[child])));
        }
        let all = roots.fold([0; 3], |sum, id| add(sum, sums[&id]));
        for (sum, what) in all.into_iter().zip(["places of objects", "vertices", "corners of faces"]) {
            if sum > MAX_ELEMENTS {
                let found = format!("the build items show {sum} {what}");
                return Err(fault(
                    "build",
                    found,
                    format!("expected at most {MAX_ELEMENTS}: split the file"),
                ));
            }
        }
        Ok(())
    }
}

fn add(a: [u64; 3], b: [u64; 3]) -> [u64; 3] {
    std::array::from_fn(|i| a[i].saturating_add(b[i]))
}
