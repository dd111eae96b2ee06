//! SQL fragments that several statements of the queue share.

/// Selects the fingerprint of the result before a stage. A job that goes back to the stage stores this fingerprint.
macro_rules! fingerprint_before {
    ($stage:literal) => {
        concat!(
            "(SELECT r.fingerprint FROM stage_result AS r WHERE r.pair = job.pair AND r.stage = ",
            $stage,
            " - 1)"
        )
    };
}
pub(crate) use fingerprint_before;

/// Selects results of a job that disagree with each other or with the pair's inputs.
macro_rules! inconsistent {
    () => {
        "SELECT 1 FROM stage_result AS r JOIN pair AS p ON p.id = r.pair JOIN fingerprint AS f ON f.id = r.fingerprint
    WHERE r.pair = job.pair AND r.stage < job.stage AND (
        r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash OR r.attributes <> p.attributes OR f.upstream IS DISTINCT FROM (
            SELECT b.fingerprint FROM stage_result AS b WHERE b.pair = r.pair AND b.stage = r.stage - 1))"
    };
}
pub(crate) use inconsistent;
