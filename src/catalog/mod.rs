//! The SQLite catalog: pairs, jobs, results, verdicts. The only room with SQL.
