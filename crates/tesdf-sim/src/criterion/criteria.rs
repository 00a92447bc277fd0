use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;
use toml::de::ValueDeserializer;

use super::any::AnyCriterion;
use super::{
    Criterion, GearRatioCriterion, InsertionCriterion, LiftCriterion, RestCriterion, ScrewCriterion,
    SeparationCriterion,
};

/// The criteria that a scene file may have. The [module](super) has an example.
#[derive(Clone, Debug)]
pub struct Criteria(BTreeMap<&'static str, Reader>);

/// Reads the table of a criterion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reader {
    pub(crate) name: &'static str,
    pub(crate) toml: fn(ValueDeserializer<'_>) -> Result<Arc<dyn AnyCriterion>, toml::de::Error>,
    pub(crate) json: fn(Value) -> Result<Arc<dyn AnyCriterion>, serde_json::Error>,
}

impl Default for Criteria {
    fn default() -> Self {
        Self::standard()
    }
}

impl Criteria {
    /// The criteria of this crate, which `docs/scene-file.md` lists.
    pub fn standard() -> Self {
        Self(BTreeMap::new())
            .with::<GearRatioCriterion>()
            .with::<InsertionCriterion>()
            .with::<LiftCriterion>()
            .with::<RestCriterion>()
            .with::<ScrewCriterion>()
            .with::<SeparationCriterion>()
    }

    /// These criteria and `C`, which replaces a criterion of the same name.
    #[must_use]
    pub fn with<C: Criterion>(mut self) -> Self {
        let reader = Reader {
            name: C::NAME,
            toml: |table| Ok(Arc::new(C::deserialize(table)?)),
            json: |table| Ok(Arc::new(C::deserialize(table)?)),
        };
        self.0.insert(C::NAME, reader);
        self
    }

    /// The names of the criteria, sorted.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.keys().copied()
    }

    /// The reader of the criterion `name`.
    ///
    /// # Errors
    /// A message that lists the names.
    pub(crate) fn reader(&self, name: &str) -> Result<Reader, String> {
        self.0.get(name).copied().ok_or_else(|| {
            let names: Vec<&str> = self.names().collect();
            format!("there is no criterion {name}; expected one of {}", names.join(", "))
        })
    }
}
