//! Recipes: what the result of a stage depends on besides the inputs.

use serde_json::{Value, json};

use crate::domain::{ContentHash, Stage};

/// One stage's recipe.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Hash over the stage, its fields and the recipe before it.
    pub hash: ContentHash,
    /// Revision and settings of the stage.
    pub fields: Value,
}

/// The current recipes of the four stages.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipes([Recipe; 4]);

impl Recipes {
    /// Recipes from each stage's fields. A stage's hash takes in the one before it, so that a changed setting
    /// changes the recipes of its stage and of all later ones.
    pub fn new(fields: impl Fn(Stage) -> Value) -> Self {
        let mut upstream: Option<ContentHash> = None;
        Self(Stage::ALL.map(|stage| {
            let fields = fields(stage);
            let whole = json!({ "stage": stage, "fields": fields, "upstream": upstream });
            let hash = ContentHash::of(whole.to_string().as_bytes());
            upstream = Some(hash);
            Recipe { hash, fields }
        }))
    }

    /// The recipe of a stage.
    pub fn of(&self, stage: Stage) -> &Recipe {
        &self.0[stage.index()]
    }
}
