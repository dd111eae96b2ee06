//! What a task stands for and does.

use sqlx::SqlitePool;

/// Stages of a pair.
const STAGES: u32 = 4;

/// What is put into the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// A task a stage.
    Stages,
    /// A task a pair, and an update a stage.
    Updates,
}

impl Load {
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "stages" => Some(Self::Stages),
            "updates" => Some(Self::Updates),
            _ => None,
        }
    }

    /// Tasks for so many pairs.
    pub const fn tasks(self, pairs: u32) -> u32 {
        match self {
            Self::Stages => pairs * STAGES,
            Self::Updates => pairs,
        }
    }

    /// A row a pair, where pairs are updated.
    pub async fn prepare(self, pool: &SqlitePool, pairs: u32) -> sqlx::Result<()> {
        if self == Self::Stages {
            return Ok(());
        }
        sqlx::query(
            "CREATE TABLE progress (pair INTEGER PRIMARY KEY, stage INTEGER NOT NULL) STRICT",
        )
        .execute(pool)
        .await?;
        sqlx::query(
            "WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i + 1 < ?1)
            INSERT INTO progress SELECT i, 0 FROM n",
        )
        .bind(pairs)
        .execute(pool)
        .await?;
        Ok(())
    }

    /// Stages that compute nothing, each stored before the next.
    pub async fn work(self, pool: &SqlitePool, task: u32) -> sqlx::Result<()> {
        if self == Self::Stages {
            return Ok(());
        }
        for stage in 1..=STAGES {
            sqlx::query("UPDATE progress SET stage = ?2 WHERE pair = ?1")
                .bind(task)
                .bind(stage)
                .execute(pool)
                .await?;
        }
        Ok(())
    }
}
