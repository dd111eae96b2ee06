-- How many pairs are stale or doubtful, without a look at every pair.
PRAGMA user_version = 4;

-- A recipe takes in the one of the stage before it.
ALTER TABLE recipe ADD COLUMN upstream INTEGER REFERENCES recipe (id);
UPDATE recipe SET upstream = (
    SELECT before.recipe FROM stage_result AS own
        JOIN stage_result AS before ON before.pair = own.pair AND before.stage = own.stage - 1
    WHERE own.recipe = recipe.id LIMIT 1);

-- The recipe of the result right behind the cursor, where it took in those of all results before it; none where some
-- were computed with other settings meanwhile.
ALTER TABLE job ADD COLUMN made INTEGER REFERENCES recipe (id);
-- Whether a metric of the last result is unsure of itself.
ALTER TABLE job ADD COLUMN doubtful INTEGER NOT NULL DEFAULT 0 CHECK (doubtful IN (0, 1));
UPDATE job SET made = (
    SELECT r.recipe FROM stage_result AS r WHERE r.pair = job.pair AND r.stage = job.stage - 1 AND NOT EXISTS (
        SELECT 1 FROM stage_result AS own JOIN recipe ON recipe.id = own.recipe
        WHERE own.pair = r.pair AND own.stage BETWEEN 1 AND r.stage AND recipe.upstream IS NOT (
            SELECT recipe FROM stage_result AS before WHERE before.pair = r.pair AND before.stage = own.stage - 1)))
WHERE stage > 0;
CREATE INDEX job_mixed ON job (pair) WHERE made IS NULL AND stage > 0;
UPDATE job SET doubtful = 1 WHERE pair IN (SELECT pair FROM metric_result WHERE confidence < 0.5);
CREATE INDEX job_doubtful ON job (pair) WHERE doubtful = 1 AND status = 3;
DROP INDEX metric_doubtful;

-- Jobs by that recipe. Triggers, because the recipe a job leaves behind is known nowhere else.
CREATE TABLE made (
    recipe INTEGER PRIMARY KEY REFERENCES recipe (id),
    n INTEGER NOT NULL CHECK (n >= 0)
) STRICT;
INSERT INTO made SELECT made, count(*) FROM job WHERE made IS NOT NULL GROUP BY made;
CREATE TRIGGER job_made AFTER UPDATE OF made ON job WHEN OLD.made IS NOT NEW.made BEGIN
    UPDATE made SET n = n - 1 WHERE recipe = OLD.made;
    INSERT INTO made SELECT NEW.made, 1 WHERE NEW.made IS NOT NULL ON CONFLICT (recipe) DO UPDATE SET n = n + 1;
END;

-- Pairs whose files or facts changed since they may have been computed; a run takes out those it has looked after.
CREATE TABLE moved (pair INTEGER PRIMARY KEY REFERENCES pair (id)) STRICT;
INSERT INTO moved SELECT p.id FROM pair AS p WHERE EXISTS (
    SELECT 1 FROM stage_result AS r
    WHERE r.pair = p.id AND (r.mesh_hash <> p.mesh_hash OR r.print_hash <> p.print_hash OR r.facts <> p.facts));
CREATE TRIGGER pair_moved AFTER UPDATE OF mesh_hash, print_hash, facts ON pair
WHEN OLD.mesh_hash <> NEW.mesh_hash OR OLD.print_hash <> NEW.print_hash OR OLD.facts <> NEW.facts BEGIN
    INSERT INTO moved VALUES (NEW.id) ON CONFLICT (pair) DO NOTHING;
END;
