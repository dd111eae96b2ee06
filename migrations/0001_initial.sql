-- The only schema. Times are milliseconds since the Unix epoch, hashes 32 bytes, states the codes of `domain::job`.
PRAGMA application_id = 1836016482; -- "mocb"
PRAGMA user_version = 1;

-- One start of a process that works; ids are never used again.
CREATE TABLE worker (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    host TEXT NOT NULL,
    pid INTEGER NOT NULL,
    boot_id TEXT,
    started INTEGER NOT NULL,
    beat INTEGER NOT NULL,
    ended INTEGER
) STRICT;

-- What a stage's result depends on besides the inputs.
CREATE TABLE recipe (
    id INTEGER PRIMARY KEY,
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    hash BLOB NOT NULL UNIQUE CHECK (length(hash) = 32),
    fields TEXT NOT NULL CHECK (json_valid(fields))
) STRICT;

-- A pair as imported, and its input files as last read. `facts` is what the manifest says that results depend on.
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
    facts TEXT NOT NULL CHECK (json_valid(facts)),
    mesh_hash BLOB CHECK (length(mesh_hash) = 32),
    mesh_stat TEXT,
    print_hash BLOB CHECK (length(print_hash) = 32),
    print_stat TEXT,
    imported INTEGER NOT NULL
) STRICT;

-- One hot row a pair: a cursor over the four stages.
CREATE TABLE job (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    status INTEGER NOT NULL CHECK (status BETWEEN 0 AND 5),
    prio INTEGER NOT NULL DEFAULT 0,
    run_at INTEGER,
    attempt INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    crashes INTEGER NOT NULL DEFAULT 0 CHECK (crashes >= 0),
    epoch INTEGER NOT NULL DEFAULT 0 CHECK (epoch >= 0),
    worker INTEGER REFERENCES worker (id),
    deadline INTEGER,
    mem_class INTEGER NOT NULL DEFAULT 0 CHECK (mem_class IN (0, 1)),
    CHECK ((status = 3) = (stage = 4)),
    CHECK ((status = 1) = (worker IS NOT NULL)),
    CHECK ((status = 1) = (deadline IS NOT NULL)),
    CHECK ((status = 2) = (run_at IS NOT NULL))
) STRICT;
CREATE INDEX job_ready ON job (prio, stage DESC, pair) WHERE status = 0;
CREATE INDEX job_leased ON job (worker) WHERE status = 1;
CREATE INDEX job_backoff ON job (run_at) WHERE status = 2;
CREATE INDEX job_bad ON job (stage, pair) WHERE status IN (4, 5);

-- Why a job backs off or is quarantined, and what it was run on.
CREATE TABLE failure (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    class TEXT NOT NULL CHECK (class IN ('bad_input', 'no_solution', 'io', 'resource', 'bug')),
    message TEXT NOT NULL,
    recipe INTEGER REFERENCES recipe (id),
    mesh_hash BLOB CHECK (length(mesh_hash) = 32),
    print_hash BLOB CHECK (length(print_hash) = 32),
    facts TEXT,
    at INTEGER NOT NULL
) STRICT;

-- Every try of every stage; old ones are pruned when a pair fails often.
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

-- The current result of each stage, with the recipe and inputs it was computed from.
CREATE TABLE stage_result (
    pair INTEGER NOT NULL REFERENCES pair (id),
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 3),
    recipe INTEGER NOT NULL REFERENCES recipe (id),
    mesh_hash BLOB NOT NULL CHECK (length(mesh_hash) = 32),
    print_hash BLOB CHECK (length(print_hash) = 32),
    facts TEXT NOT NULL,
    outcome TEXT NOT NULL CHECK (json_valid(outcome)),
    files TEXT NOT NULL CHECK (json_valid(files)),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    ms INTEGER NOT NULL,
    worker INTEGER NOT NULL REFERENCES worker (id),
    at INTEGER NOT NULL,
    PRIMARY KEY (pair, stage),
    CHECK (stage < 2 OR print_hash IS NOT NULL)
) STRICT;

-- The numbers of each threshold metric; verdicts are bound to its result_hash.
CREATE TABLE metric_result (
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble')),
    threshold_level INTEGER NOT NULL,
    threshold_depth REAL NOT NULL,
    print_from_depth TEXT NOT NULL CHECK (json_valid(print_from_depth)),
    angle_deg REAL NOT NULL,
    scale REAL NOT NULL,
    shift_x_px REAL NOT NULL,
    shift_y_px REAL NOT NULL,
    ssim REAL NOT NULL,
    nl_ssim REAL NOT NULL,
    iou REAL NOT NULL,
    iou_box REAL NOT NULL,
    dice REAL NOT NULL,
    density_print REAL NOT NULL,
    density_depth REAL NOT NULL,
    margin REAL NOT NULL,
    at_bound INTEGER NOT NULL CHECK (at_bound IN (0, 1)),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    PRIMARY KEY (pair, metric)
) STRICT;

-- What people judged. Nothing is ever changed or removed; an act is taken back by a row in verdict_undo.
CREATE TABLE verdict (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    act INTEGER NOT NULL,
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail', 'unsure')),
    reader TEXT NOT NULL CHECK (reader <> ''),
    reason TEXT CHECK (reason IN ('angle', 'strokes_lost', 'background_in', 'shift_or_scale', 'mirrored', 'wrong_pair')),
    note TEXT,
    at INTEGER NOT NULL
) STRICT;
CREATE INDEX verdict_pair ON verdict (pair, metric, reader, id);
CREATE INDEX verdict_act ON verdict (act);
CREATE TABLE verdict_undo (
    act INTEGER PRIMARY KEY,
    at INTEGER NOT NULL
) STRICT;
CREATE TRIGGER verdict_no_update BEFORE UPDATE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_no_delete BEFORE DELETE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_undo_no_update BEFORE UPDATE ON verdict_undo BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_undo_no_delete BEFORE DELETE ON verdict_undo BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;

-- True alignments, where a dataset has them.
CREATE TABLE truth (
    pair INTEGER PRIMARY KEY REFERENCES pair (id),
    body TEXT NOT NULL CHECK (json_valid(body))
) STRICT;

-- Jobs by cursor and status, moved in the same transaction as the jobs.
CREATE TABLE counter (
    stage INTEGER NOT NULL CHECK (stage BETWEEN 0 AND 4),
    status INTEGER NOT NULL CHECK (status BETWEEN 0 AND 5),
    n INTEGER NOT NULL CHECK (n >= 0),
    PRIMARY KEY (stage, status)
) STRICT, WITHOUT ROWID;
INSERT INTO counter (stage, status, n)
SELECT stage.value, status.value, 0 FROM json_each('[0,1,2,3,4]') AS stage, json_each('[0,1,2,3,4,5]') AS status;
