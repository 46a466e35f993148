-- The worlds as they are now: what a question is asked of unless it names a revision.

CREATE VIEW current_world AS
SELECT w.id, w.name, w.revision, w.content_key
FROM world AS w
WHERE NOT EXISTS (SELECT 1 FROM world AS later WHERE later.name = w.name AND later.revision > w.revision);
COMMENT ON VIEW current_world IS 'The newest revision of each world.';
COMMENT ON COLUMN current_world.id IS 'identity of this revision of the world';
COMMENT ON COLUMN current_world.name IS 'name of the world';
COMMENT ON COLUMN current_world.revision IS 'its newest revision';
COMMENT ON COLUMN current_world.content_key IS 'hash of all that the world file says';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('current_world', 'world', 'view');
