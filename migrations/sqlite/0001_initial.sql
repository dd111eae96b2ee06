-- The whole schema. Times are milliseconds since the Unix epoch, hashes are 32 bytes, states are the codes of
-- `domain::job`. In SQLite before 3.45, `json_valid(NULL)` is 0, so checks of columns that may be NULL ask for NULL first.
PRAGMA application_id = 1836016482; -- "mocb"
PRAGMA user_version = 16;

-- One row per start of a worker process; ids are never reused. `fingerprints` are the settings it computes with, as a
-- JSON array by stage; `died` is set when others found it dead. `metrics` are counts and times of the process, which it
-- stores with its heartbeats: `domain::WorkerMetrics` as JSON.
CREATE TABLE worker (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    host TEXT NOT NULL,
    pid INTEGER NOT NULL,
    boot_id TEXT,
    started INTEGER NOT NULL,
    heartbeat INTEGER NOT NULL,
    ended INTEGER,
    fingerprints TEXT CHECK (fingerprints IS NULL OR json_valid(fingerprints)),
    block_settings TEXT CHECK (block_settings IS NULL OR json_valid(block_settings)),
    died INTEGER NOT NULL DEFAULT 0 CHECK (died IN (0, 1)),
    metrics TEXT CHECK (metrics IS NULL OR json_valid(metrics))
) STRICT;

-- What a stage's result depends on besides the inputs: its settings and revision, and the fingerprint of the stage
-- before it.
CREATE TABLE fingerprint (
    id INTEGER PRIMARY KEY,
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    hash BLOB NOT NULL UNIQUE CHECK (length(hash) = 32),
    fields TEXT NOT NULL CHECK (json_valid(fields)),
    upstream INTEGER REFERENCES fingerprint (id)
) STRICT;

-- A pair as imported, and its input files as last read. `attributes` are the manifest columns that results depend on.
-- `prior` is the alignment that is expected of a pair cut from a block.
CREATE TABLE pair (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    mesh_path TEXT NOT NULL,
    print_path TEXT NOT NULL,
    unit TEXT CHECK (unit IN ('mm', 'cm', 'm', 'in')),
    scanned_face_down INTEGER CHECK (scanned_face_down IN (0, 1)),
    character TEXT,
    block TEXT,
    meta TEXT NOT NULL CHECK (json_valid(meta)),
    prior TEXT CHECK (prior IS NULL OR json_valid(prior)),
    attributes TEXT NOT NULL CHECK (json_valid(attributes)),
    mesh_hash BLOB CHECK (length(mesh_hash) = 32),
    mesh_stat TEXT,
    print_hash BLOB CHECK (length(print_hash) = 32),
    print_stat TEXT,
    imported INTEGER NOT NULL
) STRICT;
CREATE INDEX pair_block ON pair (block) WHERE block IS NOT NULL;
CREATE INDEX pair_character ON pair (character) WHERE character IS NOT NULL;

-- One hot row per pair: a cursor over the four stages. `fingerprint` is that of the result before the cursor;
-- `dirty` marks a job whose results may not agree with that fingerprint's chain or with the pair's inputs.
CREATE TABLE job (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    status INTEGER NOT NULL CHECK (status BETWEEN 0 AND 4),
    prio INTEGER NOT NULL DEFAULT 0,
    run_at INTEGER,
    attempt INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    crashes INTEGER NOT NULL DEFAULT 0 CHECK (crashes >= 0),
    token INTEGER NOT NULL DEFAULT 0 CHECK (token >= 0),
    worker INTEGER REFERENCES worker (id),
    deadline INTEGER,
    exclusive INTEGER NOT NULL DEFAULT 0 CHECK (exclusive IN (0, 1)),
    fingerprint INTEGER REFERENCES fingerprint (id),
    dirty INTEGER NOT NULL DEFAULT 0 CHECK (dirty IN (0, 1)),
    low_confidence INTEGER NOT NULL DEFAULT 0 CHECK (low_confidence IN (0, 1)),
    CHECK ((status = 3) = (stage = 4)),
    CHECK ((status = 1) = (worker IS NOT NULL)),
    CHECK ((status = 1) = (deadline IS NOT NULL)),
    CHECK ((status = 2) = (run_at IS NOT NULL))
) STRICT;
CREATE INDEX job_ready ON job (prio, stage DESC, pair) WHERE status = 0;
CREATE INDEX job_leased ON job (worker) WHERE status = 1;
CREATE INDEX job_backoff ON job (run_at) WHERE status = 2;
CREATE INDEX job_quarantined ON job (pair) WHERE status = 4;
CREATE INDEX job_dirty ON job (pair) WHERE dirty = 1;
CREATE INDEX job_low_confidence ON job (pair) WHERE low_confidence = 1 AND status = 3;

-- Why a job backs off or is quarantined, with the settings and inputs of the failed attempt.
CREATE TABLE failure (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    class TEXT NOT NULL CHECK (class IN ('bad_input', 'no_solution', 'io', 'resource', 'bug')),
    message TEXT NOT NULL,
    fingerprint INTEGER REFERENCES fingerprint (id),
    mesh_hash BLOB CHECK (length(mesh_hash) = 32),
    print_hash BLOB CHECK (length(print_hash) = 32),
    attributes TEXT,
    at INTEGER NOT NULL
) STRICT;
CREATE INDEX failure_class ON failure (class);

-- Every attempt of every stage; old ones are pruned when a pair fails often.
CREATE TABLE attempt (
    id INTEGER PRIMARY KEY,
    pair INTEGER NOT NULL REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    worker INTEGER,
    class TEXT CHECK (class IN ('bad_input', 'no_solution', 'io', 'resource', 'bug')),
    message TEXT,
    ms INTEGER,
    at INTEGER NOT NULL,
    CHECK ((class IS NULL) = (message IS NULL))
) STRICT;
CREATE INDEX attempt_pair ON attempt (pair, id);

-- The current result of each stage, with the settings and inputs it was computed from.
CREATE TABLE stage_result (
    pair INTEGER NOT NULL REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    fingerprint INTEGER NOT NULL REFERENCES fingerprint (id),
    mesh_hash BLOB NOT NULL CHECK (length(mesh_hash) = 32),
    print_hash BLOB CHECK (length(print_hash) = 32),
    attributes TEXT NOT NULL,
    outcome TEXT NOT NULL CHECK (json_valid(outcome)),
    files TEXT NOT NULL CHECK (json_valid(files)),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    ms INTEGER NOT NULL,
    worker INTEGER NOT NULL REFERENCES worker (id),
    at INTEGER NOT NULL,
    PRIMARY KEY (pair, stage),
    CHECK (stage < 2 OR print_hash IS NOT NULL)
) STRICT;

-- The hash of the current result of each threshold metric, by which verdicts refer to it. The scores are in the outcome of
-- the last stage; those by which lists are sorted are here too.
CREATE TABLE metric_result (
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    confidence REAL,
    iou REAL,
    PRIMARY KEY (pair, metric)
) STRICT;
CREATE INDEX metric_result_confidence ON metric_result (metric, confidence, pair);
CREATE INDEX metric_result_iou ON metric_result (metric, iou, pair);

-- Actions of reviewers. Each belongs to one reviewer, and so does all that refers to it.
CREATE TABLE review_act (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    reviewer TEXT NOT NULL CHECK (reviewer <> ''),
    UNIQUE (id, reviewer)
) STRICT;

-- Verdicts of people. Append-only; the verdicts of an action are undone by a row in verdict_undo. `event` is the client's id of the action, so
-- that a request sent twice is stored once; `seen` is the hash of what was on the screen, `shown_ms` how long it was
-- there, `angle_read_deg` the rotation that the reviewer found missing, `review_order` the order in which results came.
CREATE TABLE verdict (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    act INTEGER NOT NULL,
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail', 'unsure')),
    reviewer TEXT NOT NULL CHECK (reviewer <> ''),
    reason TEXT CHECK (reason IN ('angle', 'strokes_lost', 'background_in', 'shift_or_scale', 'mirrored', 'wrong_pair')),
    note TEXT,
    at INTEGER NOT NULL,
    event TEXT CHECK (event <> ''),
    seen BLOB CHECK (length(seen) = 32),
    shown_ms INTEGER CHECK (shown_ms >= 0),
    angle_read_deg REAL CHECK (angle_read_deg BETWEEN -180 AND 180),
    review_order TEXT CHECK (review_order IN ('random', 'least_confident', 'adjudicate')),
    FOREIGN KEY (act, reviewer) REFERENCES review_act (id, reviewer)
) STRICT;
CREATE INDEX verdict_pair ON verdict (pair, metric, reviewer, id);
CREATE INDEX verdict_act ON verdict (act);
CREATE INDEX verdict_value ON verdict (verdict, pair);
CREATE UNIQUE INDEX verdict_event ON verdict (event, metric) WHERE event IS NOT NULL;
CREATE TABLE verdict_undo (
    act INTEGER PRIMARY KEY,
    reviewer TEXT NOT NULL,
    at INTEGER NOT NULL,
    FOREIGN KEY (act, reviewer) REFERENCES review_act (id, reviewer)
) STRICT;
CREATE TRIGGER review_act_no_update BEFORE UPDATE ON review_act BEGIN SELECT RAISE (ABORT, 'actions are append-only'); END;
CREATE TRIGGER review_act_no_delete BEFORE DELETE ON review_act BEGIN SELECT RAISE (ABORT, 'actions are append-only'); END;
CREATE TRIGGER verdict_no_update BEFORE UPDATE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_no_delete BEFORE DELETE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_undo_no_update BEFORE UPDATE ON verdict_undo BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_undo_no_delete BEFORE DELETE ON verdict_undo BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;

-- Ground-truth alignments, where a dataset has them.
CREATE TABLE truth (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    body TEXT NOT NULL CHECK (json_valid(body))
) STRICT;

-- A trigger, so that no write to `pair` can forget the mark.
CREATE TRIGGER pair_changed AFTER UPDATE OF mesh_hash, print_hash, attributes ON pair
WHEN OLD.mesh_hash <> NEW.mesh_hash OR OLD.print_hash <> NEW.print_hash OR OLD.attributes <> NEW.attributes BEGIN
    UPDATE job SET dirty = 1 WHERE pair = NEW.id;
END;

-- Numbers of jobs by cursor, status and fingerprint (0 for none), changed in the same transaction as the jobs.
CREATE TABLE counter (
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    status INTEGER NOT NULL CHECK (status BETWEEN 0 AND 4),
    fingerprint INTEGER NOT NULL,
    n INTEGER NOT NULL CHECK (n >= 0),
    PRIMARY KEY (stage, status, fingerprint)
) STRICT, WITHOUT ROWID;
INSERT INTO counter (stage, status, fingerprint, n) SELECT 0, value, 0, 0 FROM json_each('[0,1,2,3,4]');

-- Answers to attention checks, kept apart from verdicts so that no count of verdicts includes them.
CREATE TABLE attention_check_answer (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    event TEXT NOT NULL UNIQUE CHECK (event <> ''),
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    kind TEXT NOT NULL CHECK (kind IN ('turned', 'mirrored', 'threshold', 'duplicate')),
    attention_check TEXT NOT NULL CHECK (json_valid(attention_check)),
    seen BLOB NOT NULL CHECK (length(seen) = 32),
    shown_ms INTEGER CHECK (shown_ms >= 0),
    angle_read_deg REAL CHECK (angle_read_deg BETWEEN -180 AND 180),
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail', 'unsure')),
    reviewer TEXT NOT NULL CHECK (reviewer <> ''),
    reason TEXT CHECK (reason IN ('angle', 'strokes_lost', 'background_in', 'shift_or_scale', 'mirrored', 'wrong_pair')),
    note TEXT,
    at INTEGER NOT NULL,
    UNIQUE (id, reviewer)
) STRICT;
CREATE INDEX attention_check_answer_reviewer ON attention_check_answer (reviewer, id);
CREATE TABLE attention_check_undo (
    answer INTEGER PRIMARY KEY,
    reviewer TEXT NOT NULL,
    at INTEGER NOT NULL,
    FOREIGN KEY (answer, reviewer) REFERENCES attention_check_answer (id, reviewer)
) STRICT;

-- Manual alignments of these contents of mesh and print, made on this result of the depth stage.
CREATE TABLE manual_alignment (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    event TEXT NOT NULL UNIQUE CHECK (event <> ''),
    pair INTEGER NOT NULL REFERENCES pair (id),
    mesh_hash BLOB NOT NULL CHECK (length(mesh_hash) = 32),
    print_hash BLOB NOT NULL CHECK (length(print_hash) = 32),
    depth_hash BLOB NOT NULL CHECK (length(depth_hash) = 32),
    seen BLOB NOT NULL CHECK (length(seen) = 32),
    print_from_depth TEXT NOT NULL CHECK (json_valid(print_from_depth)),
    print_from_mesh TEXT NOT NULL CHECK (json_valid(print_from_mesh)),
    iou REAL NOT NULL CHECK (iou BETWEEN 0 AND 1),
    dice REAL NOT NULL CHECK (dice BETWEEN 0 AND 1),
    reviewer TEXT NOT NULL CHECK (reviewer <> ''),
    note TEXT,
    at INTEGER NOT NULL,
    UNIQUE (id, reviewer)
) STRICT;
CREATE INDEX manual_alignment_pair ON manual_alignment (pair, id);
CREATE TABLE manual_alignment_undo (
    alignment INTEGER PRIMARY KEY,
    reviewer TEXT NOT NULL,
    at INTEGER NOT NULL,
    FOREIGN KEY (alignment, reviewer) REFERENCES manual_alignment (id, reviewer)
) STRICT;

CREATE TRIGGER attention_check_answer_no_update BEFORE UPDATE ON attention_check_answer BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER attention_check_answer_no_delete BEFORE DELETE ON attention_check_answer BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER attention_check_undo_no_update BEFORE UPDATE ON attention_check_undo BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER attention_check_undo_no_delete BEFORE DELETE ON attention_check_undo BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER manual_alignment_no_update BEFORE UPDATE ON manual_alignment BEGIN SELECT RAISE (ABORT, 'manual alignments are append-only'); END;
CREATE TRIGGER manual_alignment_no_delete BEFORE DELETE ON manual_alignment BEGIN SELECT RAISE (ABORT, 'manual alignments are append-only'); END;
CREATE TRIGGER manual_alignment_undo_no_update BEFORE UPDATE ON manual_alignment_undo BEGIN SELECT RAISE (ABORT, 'manual alignments are append-only'); END;
CREATE TRIGGER manual_alignment_undo_no_delete BEFORE DELETE ON manual_alignment_undo BEGIN SELECT RAISE (ABORT, 'manual alignments are append-only'); END;

-- The job of a retired pair. It has no row in `job`, so runs and reports leave it out; its results and verdicts stay.
-- `cause` is who retired it: a person, a list without it, or the labels of its block, from which its box is gone. `token` is
-- the fencing token of the job.
CREATE TABLE retired_pair (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    is_quarantined INTEGER NOT NULL CHECK (is_quarantined IN (0, 1)),
    token INTEGER NOT NULL CHECK (token >= 0),
    fingerprint INTEGER REFERENCES fingerprint (id),
    low_confidence INTEGER NOT NULL CHECK (low_confidence IN (0, 1)),
    cause TEXT NOT NULL CHECK (cause IN ('person', 'list', 'labels')),
    at INTEGER NOT NULL
) STRICT;

-- A whole block as imported: the scan of a face, the image of its page, and perhaps labels; and these files as last read.
-- `attributes` are the columns that results depend on, `meta` those without a meaning for the program. `true_boxes` are
-- boxes on the page that are known to be right, if there are any: a list of `domain::TrueBox` as JSON. `control_points` are
-- places that a person chose on the scan and on the page, with the hashes of both files.
CREATE TABLE block (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    mesh_path TEXT NOT NULL,
    page_path TEXT NOT NULL,
    labels_path TEXT,
    unit TEXT CHECK (unit IN ('mm', 'cm', 'm', 'in')),
    side TEXT CHECK (side IN ('front', 'back')),
    meta TEXT NOT NULL CHECK (json_valid(meta)),
    attributes TEXT NOT NULL CHECK (json_valid(attributes)),
    mesh_hash BLOB CHECK (length(mesh_hash) = 32),
    mesh_stat TEXT,
    page_hash BLOB CHECK (length(page_hash) = 32),
    page_stat TEXT,
    labels_hash BLOB CHECK (length(labels_hash) = 32),
    labels_stat TEXT,
    imported INTEGER NOT NULL,
    true_boxes TEXT CHECK (true_boxes IS NULL OR json_valid(true_boxes)),
    control_points TEXT CHECK (control_points IS NULL OR json_valid(control_points))
) STRICT;

-- One row per block: a cursor over the stages face, align, boxes and cut, with a lease as in `job`.
CREATE TABLE block_job (
    block INTEGER PRIMARY KEY REFERENCES block (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    status INTEGER NOT NULL CHECK (status BETWEEN 0 AND 4),
    run_at INTEGER,
    attempt INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    crashes INTEGER NOT NULL DEFAULT 0 CHECK (crashes >= 0),
    token INTEGER NOT NULL DEFAULT 0 CHECK (token >= 0),
    worker INTEGER REFERENCES worker (id),
    deadline INTEGER,
    CHECK ((status = 3) = (stage = 4)),
    CHECK ((status = 1) = (worker IS NOT NULL)),
    CHECK ((status = 1) = (deadline IS NOT NULL)),
    CHECK ((status = 2) = (run_at IS NOT NULL))
) STRICT;
CREATE INDEX block_job_leased ON block_job (worker) WHERE status = 1;

-- Why the job of a block backs off or is quarantined. `made_with` are the settings, inputs and attributes of the failed
-- attempt.
CREATE TABLE block_failure (
    block INTEGER PRIMARY KEY REFERENCES block (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    class TEXT NOT NULL CHECK (class IN ('bad_input', 'no_solution', 'io', 'resource', 'bug')),
    message TEXT NOT NULL,
    made_with TEXT NOT NULL CHECK (json_valid(made_with)),
    at INTEGER NOT NULL
) STRICT;

-- The current result of each stage of a block. `made_with` are the settings, inputs and attributes that it was computed
-- from, as JSON.
CREATE TABLE block_result (
    block INTEGER NOT NULL REFERENCES block (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    made_with TEXT NOT NULL CHECK (json_valid(made_with)),
    outcome TEXT NOT NULL CHECK (json_valid(outcome)),
    files TEXT NOT NULL CHECK (json_valid(files)),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    ms INTEGER NOT NULL,
    worker INTEGER NOT NULL REFERENCES worker (id),
    at INTEGER NOT NULL,
    PRIMARY KEY (block, stage)
) STRICT;

-- Every attempt of every stage of a block; old ones are pruned.
CREATE TABLE block_attempt (
    id INTEGER PRIMARY KEY,
    block INTEGER NOT NULL REFERENCES block (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    worker INTEGER,
    class TEXT CHECK (class IN ('bad_input', 'no_solution', 'io', 'resource', 'bug')),
    message TEXT,
    ms INTEGER,
    at INTEGER NOT NULL,
    CHECK ((class IS NULL) = (message IS NULL))
) STRICT;
CREATE INDEX block_attempt_block ON block_attempt (block, id);

-- The characters of a block by label. `place` is the reading order, `box` the edges on the page in pixels (left, top,
-- right, bottom), `maps` the maps between crop, mesh and page as JSON.
CREATE TABLE block_character (
    block INTEGER NOT NULL REFERENCES block (id),
    label TEXT NOT NULL,
    place INTEGER NOT NULL,
    character TEXT,
    box TEXT NOT NULL CHECK (json_valid(box)),
    confidence REAL CHECK (confidence BETWEEN 0 AND 1),
    state TEXT NOT NULL CHECK (state IN ('cut', 'left', 'retired')),
    reason TEXT,
    maps TEXT CHECK (maps IS NULL OR json_valid(maps)),
    pair INTEGER UNIQUE REFERENCES pair (id),
    PRIMARY KEY (block, label)
) STRICT;

-- Checksums of rows. `record` is the number of a table: see `ChecksummedTable` in `crates/catalog/src/db/checksummed_table.rs`. In a
-- log, `previous` is the row before.
CREATE TABLE checksum (
    record INTEGER NOT NULL,
    row INTEGER NOT NULL,
    value INTEGER NOT NULL,
    previous INTEGER,
    PRIMARY KEY (record, row),
    FOREIGN KEY (record, previous) REFERENCES checksum (record, row)
) STRICT, WITHOUT ROWID;

-- Damaged rows that the owner has set apart: they are not counted, and no longer reported as damage. A row stays in its
-- table. `value` is the checksum that it would have, so that a later change is damage again.
CREATE TABLE set_apart (
    record INTEGER NOT NULL,
    row INTEGER NOT NULL,
    value INTEGER NOT NULL,
    fault TEXT NOT NULL,
    at INTEGER NOT NULL,
    PRIMARY KEY (record, row)
) STRICT, WITHOUT ROWID;

-- Key for the names of pictures on the review page: they reveal nothing and stay the same after a restart.
CREATE TABLE review_key (id INTEGER PRIMARY KEY CHECK (id = 1), key BLOB NOT NULL CHECK (length(key) = 32)) STRICT;
INSERT INTO review_key (id, key) VALUES (1, randomblob(32));

-- Identifies this catalog, as the owner of a place of artifacts. Made anew for a restored catalog, never copied.
CREATE TABLE catalog_identity (row INTEGER PRIMARY KEY CHECK (row = 1), id BLOB NOT NULL CHECK (length(id) = 16)) STRICT;
INSERT INTO catalog_identity (row, id) VALUES (1, randomblob(16));
