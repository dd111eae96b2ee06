-- What a worker computed with, so that a pair that kills it can be tried again with other settings, and whether it was
-- found dead.
PRAGMA user_version = 3;

ALTER TABLE worker ADD COLUMN recipes TEXT CHECK (json_valid(recipes));
ALTER TABLE worker ADD COLUMN died INTEGER NOT NULL DEFAULT 0 CHECK (died IN (0, 1));
