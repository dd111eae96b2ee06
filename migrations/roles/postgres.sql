-- Four group roles of a catalog. May be run again, for example after an upgrade of the schema. The administrator creates
-- the logins, and adds each to a role: GRANT mocban_reviewer TO lan;

-- Roles belong to the whole server, so another catalog may have created them already.
DO $$
DECLARE
    name text;
BEGIN
    FOREACH name IN ARRAY ARRAY['mocban_owner', 'mocban_worker', 'mocban_reviewer', 'mocban_viewer'] LOOP
        IF NOT EXISTS (SELECT 1 FROM pg_roles WHERE rolname = name) THEN
            EXECUTE format('CREATE ROLE %I NOLOGIN', name);
        END IF;
    END LOOP;
    FOREACH name IN ARRAY ARRAY['mocban_worker', 'mocban_reviewer'] LOOP
        IF NOT pg_has_role(name, 'mocban_viewer', 'MEMBER') THEN
            EXECUTE format('GRANT mocban_viewer TO %I', name);
        END IF;
    END LOOP;
    IF NOT pg_has_role('mocban_owner', 'USAGE') THEN
        GRANT mocban_owner TO CURRENT_USER;
    END IF;
END $$;

-- The schema and all that is in it belong to mocban_owner, so that each of its members can upgrade the schema. Indexes
-- and sequences follow their tables.
DO $$
DECLARE
    object text;
BEGIN
    FOR object IN
        SELECT format('SCHEMA %I', nspname) FROM pg_namespace
        WHERE nspname = '{schema}' AND nspowner <> CAST('mocban_owner' AS regrole)
        UNION ALL
        SELECT format('%s %s', CASE relkind WHEN 'v' THEN 'VIEW' ELSE 'TABLE' END, CAST(oid AS regclass)) FROM pg_class
        WHERE relnamespace = CAST('{schema}' AS regnamespace) AND relkind IN ('r', 'v') AND relowner <> CAST('mocban_owner' AS regrole)
        UNION ALL
        SELECT format('FUNCTION %s', CAST(oid AS regprocedure)) FROM pg_proc
        WHERE pronamespace = CAST('{schema}' AS regnamespace) AND proowner <> CAST('mocban_owner' AS regrole)
        UNION ALL
        SELECT format('OPERATOR %s', CAST(oid AS regoperator)) FROM pg_operator
        WHERE oprnamespace = CAST('{schema}' AS regnamespace) AND oprowner <> CAST('mocban_owner' AS regrole)
    LOOP
        EXECUTE format('ALTER %s OWNER TO mocban_owner', object);
    END LOOP;
END $$;

REVOKE ALL ON ALL TABLES IN SCHEMA {schema} FROM mocban_worker, mocban_reviewer, mocban_viewer;

-- Viewers read everything. Workers and reviewers are viewers too.
GRANT USAGE ON SCHEMA {schema} TO mocban_viewer;
GRANT SELECT ON ALL TABLES IN SCHEMA {schema} TO mocban_viewer;
GRANT EXECUTE ON ALL FUNCTIONS IN SCHEMA {schema} TO mocban_viewer;

-- Workers: what `import`, `plan`, `run`, `worker` and `retry` write.
GRANT INSERT, UPDATE ON worker, run_settings, fingerprint, pair, truth, block, block_job TO mocban_worker;
GRANT INSERT, UPDATE, DELETE ON job, retired_pair, failure, attempt, stage_result, metric_result, counter_part, block_result,
    block_failure, block_attempt, block_character TO mocban_worker;
GRANT INSERT, UPDATE (value) ON checksum TO mocban_worker;

-- Workers append verdicts with `verdict import`. Reviewers append all that the review page stores. Nobody else may, and
-- nobody may choose the number of a row or of an action. Triggers of the schema refuse to change or delete these rows, for the owner too.
GRANT INSERT (reviewer) ON review_act TO mocban_worker, mocban_reviewer;
GRANT INSERT (act, pair, metric, result_hash, verdict, reviewer, reason, note, at, event, seen, shown_ms, angle_read_deg,
    review_order) ON verdict TO mocban_worker, mocban_reviewer;
GRANT INSERT (event, pair, metric, result_hash, kind, attention_check, seen, shown_ms, angle_read_deg, verdict, reviewer,
    reason, note, at) ON attention_check_answer TO mocban_reviewer;
GRANT INSERT (event, pair, mesh_hash, print_hash, depth_hash, seen, print_from_depth, print_from_mesh, iou, dice, reviewer,
    note, at) ON manual_alignment TO mocban_reviewer;
GRANT INSERT ON verdict_undo, attention_check_undo, manual_alignment_undo, checksum TO mocban_reviewer;

-- Row-level security. Policies do not apply to the owner, and a user with several roles may do what any of them may.
DO $$
DECLARE
    name text;
    policy record;
BEGIN
    FOR policy IN SELECT policyname, tablename FROM pg_policies WHERE schemaname = '{schema}' LOOP
        EXECUTE format('DROP POLICY %I ON %I', policy.policyname, policy.tablename);
    END LOOP;
    FOREACH name IN ARRAY ARRAY['review_act', 'verdict', 'verdict_undo', 'attention_check_answer', 'attention_check_undo',
        'manual_alignment', 'manual_alignment_undo', 'checksum'] LOOP
        EXECUTE format('ALTER TABLE %I ENABLE ROW LEVEL SECURITY', name);
        EXECUTE format('CREATE POLICY anyone_reads ON %I FOR SELECT USING (true)', name);
    END LOOP;
END $$;

CREATE POLICY worker_adds ON review_act FOR INSERT TO mocban_worker WITH CHECK (true);
CREATE POLICY worker_adds ON verdict FOR INSERT TO mocban_worker WITH CHECK (true);

-- A reviewer's name is the name of the login user, in every row. A policy compares only columns of its own row, because a
-- transaction may see an old state of other tables. Foreign keys on a number and a reviewer do the rest: a verdict or an
-- undo belongs to an action of its reviewer, and reviewers undo only what they stored.
DO $$
DECLARE
    name text;
BEGIN
    FOREACH name IN ARRAY ARRAY['review_act', 'verdict', 'verdict_undo', 'attention_check_answer', 'attention_check_undo',
        'manual_alignment', 'manual_alignment_undo'] LOOP
        EXECUTE format('CREATE POLICY reviewer_adds_own ON %I FOR INSERT TO mocban_reviewer
            WITH CHECK (reviewer = CAST(session_user AS text))', name);
    END LOOP;
END $$;

-- Checksums, by the number of their table (`ChecksummedTable` in `crates/catalog/src/db/checksummed_table.rs`): workers store those
-- of pairs (0), true alignments (1), verdicts (2) and blocks (8), and change those of all but verdicts. Reviewers add those
-- of the rows that they stored: a number belongs to one row, which never changes, so that an old state of its table can lack the
-- row, but not show another reviewer.
CREATE POLICY worker_adds ON checksum FOR INSERT TO mocban_worker WITH CHECK (record IN (0, 1, 2, 8));
CREATE POLICY worker_changes ON checksum FOR UPDATE TO mocban_worker USING (record IN (0, 1, 8)) WITH CHECK (record IN (0, 1, 8));
CREATE POLICY reviewer_adds_own ON checksum FOR INSERT TO mocban_reviewer WITH CHECK (CASE record
    WHEN 2 THEN EXISTS (SELECT 1 FROM verdict AS r WHERE r.id = checksum.row AND r.reviewer = CAST(session_user AS text))
    WHEN 3 THEN EXISTS (SELECT 1 FROM verdict_undo AS r WHERE r.act = checksum.row AND r.reviewer = CAST(session_user AS text))
    WHEN 4 THEN EXISTS (SELECT 1 FROM attention_check_answer AS r WHERE r.id = checksum.row AND r.reviewer = CAST(session_user AS text))
    WHEN 5 THEN EXISTS (SELECT 1 FROM attention_check_undo AS r WHERE r.answer = checksum.row AND r.reviewer = CAST(session_user AS text))
    WHEN 6 THEN EXISTS (SELECT 1 FROM manual_alignment AS r WHERE r.id = checksum.row AND r.reviewer = CAST(session_user AS text))
    WHEN 7 THEN EXISTS (SELECT 1 FROM manual_alignment_undo AS r WHERE r.alignment = checksum.row AND r.reviewer = CAST(session_user AS text))
    ELSE false END);
