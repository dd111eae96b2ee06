-- The metric `relief`, and how sure each result is. SQLite cannot change a CHECK, so the two tables that name metrics
-- are made anew and take over their rows. Nothing refers to either by a foreign key.
PRAGMA user_version = 2;

CREATE TABLE metric_result_2 (
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
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
    confidence REAL CHECK (confidence BETWEEN 0 AND 1),
    at_bound INTEGER NOT NULL CHECK (at_bound IN (0, 1)),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    PRIMARY KEY (pair, metric)
) STRICT;
INSERT INTO metric_result_2
SELECT pair, metric, threshold_level, threshold_depth, print_from_depth, angle_deg, scale, shift_x_px, shift_y_px,
    ssim, nl_ssim, iou, iou_box, dice, density_print, density_depth, margin, NULL, at_bound, result_hash
FROM metric_result;
DROP TABLE metric_result;
ALTER TABLE metric_result_2 RENAME TO metric_result;
CREATE INDEX metric_doubtful ON metric_result (pair) WHERE confidence < 0.5;

-- Dropping the old table takes its triggers with it and fires none of them.
CREATE TABLE verdict_2 (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    act INTEGER NOT NULL,
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail', 'unsure')),
    reader TEXT NOT NULL CHECK (reader <> ''),
    reason TEXT CHECK (reason IN ('angle', 'strokes_lost', 'background_in', 'shift_or_scale', 'mirrored', 'wrong_pair')),
    note TEXT,
    at INTEGER NOT NULL
) STRICT;
INSERT INTO verdict_2 (id, act, pair, metric, result_hash, verdict, reader, reason, note, at)
SELECT id, act, pair, metric, result_hash, verdict, reader, reason, note, at FROM verdict ORDER BY id;
DROP TABLE verdict;
ALTER TABLE verdict_2 RENAME TO verdict;
CREATE INDEX verdict_pair ON verdict (pair, metric, reader, id);
CREATE INDEX verdict_act ON verdict (act);
CREATE TRIGGER verdict_no_update BEFORE UPDATE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
CREATE TRIGGER verdict_no_delete BEFORE DELETE ON verdict BEGIN SELECT RAISE (ABORT, 'verdicts are append-only'); END;
