//! Recipes: what the result of a stage depends on besides the inputs.

use serde_json::{Value, json};
use sqlx::SqliteConnection;

use crate::catalog::db::error::CatalogError;
use crate::catalog::db::error::Result;
use crate::catalog::db::rows;
use crate::catalog::handle::Catalog;
use crate::catalog::queue::lease::RecipeId;
use crate::catalog::queue::plan::FieldChange;
use crate::catalog::queue::staleness::differences;
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

    /// The recipes in a line, for processes to compare; [`Catalog::changes_from`] reads it.
    pub fn terms(&self) -> String {
        self.0
            .each_ref()
            .map(|recipe| recipe.hash.to_hex())
            .join(" ")
    }
}

/// Numbers of the current recipes in the catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecipeIds([RecipeId; 4]);

impl RecipeIds {
    /// The recipe of a stage.
    pub const fn of(&self, stage: Stage) -> RecipeId {
        self.0[stage.index()]
    }

    /// The numbers as a JSON array by stage.
    pub(crate) fn json(self) -> String {
        rows::array(self.0.map(|RecipeId(id)| id)).to_string()
    }
}

const ENTER: &str = "
INSERT INTO recipe (stage, hash, fields, upstream) VALUES (?1, ?2, ?3, ?4)
ON CONFLICT (hash) DO UPDATE SET upstream = excluded.upstream RETURNING id";

impl Catalog {
    /// Enters the current recipes where they are new; gives their numbers.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn register_recipes(&self, recipes: &Recipes) -> Result<RecipeIds> {
        let recipes = recipes.clone();
        self.alone(move |conn| {
            Box::pin(async move {
                let mut upstream: Option<i64> = None;
                for stage in Stage::ALL {
                    let recipe = recipes.of(stage);
                    let id = sqlx::query_scalar(ENTER)
                        .bind(stage.index() as i64)
                        .bind(&recipe.hash.as_bytes()[..])
                        .bind(recipe.fields.to_string())
                        .bind(upstream)
                        .fetch_one(&mut *conn)
                        .await?;
                    upstream = Some(id);
                }
                let mut ids = [RecipeId(0); 4];
                for (id, found) in ids.iter_mut().zip(known(conn, &recipes).await?) {
                    *id = found.ok_or_else(|| {
                        CatalogError::Corrupt("a recipe just written is not there".to_owned())
                    })?;
                }
                Ok(RecipeIds(ids))
            })
        })
        .await
    }
}

impl Catalog {
    /// What differs between recipes as [`Recipes::terms`] told them and these; what the catalog does not know of is
    /// left out.
    ///
    /// # Errors
    /// When the database refuses.
    pub async fn changes_from(&self, terms: &str, recipes: &Recipes) -> Result<Vec<FieldChange>> {
        let mut conn = self.reader().await?;
        let mut changes = Vec::new();
        for (stage, hash) in Stage::ALL.into_iter().zip(terms.split_whitespace()) {
            let fields: Option<String> =
                sqlx::query_scalar("SELECT fields FROM recipe WHERE hash = unhex(?1)")
                    .bind(hash)
                    .fetch_optional(&mut *conn)
                    .await?;
            if let Some(fields) = fields {
                let old = serde_json::from_str(&fields)?;
                changes.extend(differences(stage, &old, &recipes.of(stage).fields));
            }
        }
        Ok(changes)
    }
}

/// Numbers of the recipes that the catalog knows.
pub(crate) async fn known(
    conn: &mut SqliteConnection,
    recipes: &Recipes,
) -> Result<[Option<RecipeId>; 4]> {
    let mut ids = [None; 4];
    for (id, stage) in ids.iter_mut().zip(Stage::ALL) {
        *id = sqlx::query_scalar("SELECT id FROM recipe WHERE hash = ?1")
            .bind(&recipes.of(stage).hash.as_bytes()[..])
            .fetch_optional(&mut *conn)
            .await?
            .map(RecipeId);
    }
    Ok(ids)
}

/// The recipes as a JSON array of stage and number for `json_each`; a number no result has where it is unknown.
pub(crate) async fn current_json(conn: &mut SqliteConnection, recipes: &Recipes) -> Result<String> {
    let ids = known(conn, recipes).await?;
    let ids = ids.iter().map(|id| id.map_or(-1, |RecipeId(id)| id));
    Ok(rows::array(ids).to_string())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::Recipes;
    use crate::domain::Stage;

    #[test]
    fn a_changed_setting_changes_its_stage_and_those_after_it() {
        let old = Recipes::new(|_| json!({ "revision": 1 }));
        let new = Recipes::new(|stage| match stage {
            Stage::Normalize => json!({ "revision": 2 }),
            Stage::Fit | Stage::Depth | Stage::Register => json!({ "revision": 1 }),
        });
        let changed = Stage::ALL.map(|stage| old.of(stage).hash != new.of(stage).hash);
        assert_eq!(changed, [false, false, true, true]);
    }
}
