-- What the review page knows of a verdict, answers to what only tests a reader, and alignments by hand.
PRAGMA user_version = 5;

-- The client's number of the act, so that one sent twice is stored once; the hash of what was on the screen, how long
-- it was there, the turn the reader found missing, and in which order results came.
ALTER TABLE verdict ADD COLUMN event TEXT CHECK (event <> '');
ALTER TABLE verdict ADD COLUMN seen BLOB CHECK (length(seen) = 32);
ALTER TABLE verdict ADD COLUMN shown_ms INTEGER CHECK (shown_ms >= 0);
ALTER TABLE verdict ADD COLUMN angle_read_deg REAL CHECK (angle_read_deg BETWEEN -180 AND 180);
ALTER TABLE verdict ADD COLUMN queue TEXT CHECK (queue IN ('random', 'least_confident', 'adjudicate'));
CREATE UNIQUE INDEX verdict_event ON verdict (event, metric) WHERE event IS NOT NULL;

-- Answers to planted faults and repeats. They lie apart from verdicts, so that nothing that counts verdicts counts them.
CREATE TABLE control_answer (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    event TEXT NOT NULL UNIQUE CHECK (event <> ''),
    pair INTEGER NOT NULL REFERENCES pair (id),
    metric TEXT NOT NULL CHECK (metric IN ('nl_ssim', 'density', 'ensemble', 'relief')),
    result_hash BLOB NOT NULL CHECK (length(result_hash) = 32),
    kind TEXT NOT NULL CHECK (kind IN ('turned', 'mirrored', 'threshold', 'duplicate')),
    control TEXT NOT NULL CHECK (json_valid(control)),
    seen BLOB NOT NULL CHECK (length(seen) = 32),
    shown_ms INTEGER CHECK (shown_ms >= 0),
    angle_read_deg REAL CHECK (angle_read_deg BETWEEN -180 AND 180),
    verdict TEXT NOT NULL CHECK (verdict IN ('pass', 'fail', 'unsure')),
    reader TEXT NOT NULL CHECK (reader <> ''),
    reason TEXT CHECK (reason IN ('angle', 'strokes_lost', 'background_in', 'shift_or_scale', 'mirrored', 'wrong_pair')),
    note TEXT,
    at INTEGER NOT NULL
) STRICT;
CREATE INDEX control_answer_reader ON control_answer (reader, id);
CREATE TABLE control_undo (
    answer INTEGER PRIMARY KEY REFERENCES control_answer (id),
    at INTEGER NOT NULL
) STRICT;

-- Alignments by hand: of these contents of mesh and print, made on this result of the depth stage.
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
    reader TEXT NOT NULL CHECK (reader <> ''),
    note TEXT,
    at INTEGER NOT NULL
) STRICT;
CREATE INDEX manual_alignment_pair ON manual_alignment (pair, id);
CREATE TABLE manual_alignment_undo (
    alignment INTEGER PRIMARY KEY REFERENCES manual_alignment (id),
    at INTEGER NOT NULL
) STRICT;

CREATE TRIGGER control_no_update BEFORE UPDATE ON control_answer BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER control_no_delete BEFORE DELETE ON control_answer BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER control_undo_no_update BEFORE UPDATE ON control_undo BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER control_undo_no_delete BEFORE DELETE ON control_undo BEGIN SELECT RAISE (ABORT, 'answers are append-only'); END;
CREATE TRIGGER manual_no_update BEFORE UPDATE ON manual_alignment BEGIN SELECT RAISE (ABORT, 'alignments by hand are append-only'); END;
CREATE TRIGGER manual_no_delete BEFORE DELETE ON manual_alignment BEGIN SELECT RAISE (ABORT, 'alignments by hand are append-only'); END;
CREATE TRIGGER manual_undo_no_update BEFORE UPDATE ON manual_alignment_undo BEGIN SELECT RAISE (ABORT, 'alignments by hand are append-only'); END;
CREATE TRIGGER manual_undo_no_delete BEFORE DELETE ON manual_alignment_undo BEGIN SELECT RAISE (ABORT, 'alignments by hand are append-only'); END;

-- What the page's names of pictures are made with, so that they tell nothing and stay the same after a restart.
CREATE TABLE review_key (id INTEGER PRIMARY KEY CHECK (id = 1), key BLOB NOT NULL CHECK (length(key) = 32)) STRICT;
INSERT INTO review_key (id, key) VALUES (1, randomblob(32));
