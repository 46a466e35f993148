-- The catalogue: what each relation of the store is.

CREATE TABLE sds_relation (
    relation TEXT PRIMARY KEY,
    level TEXT NOT NULL,
    standing TEXT NOT NULL,
    CHECK (level IN ('catalogue', 'run', 'world', 'object', 'part', 'surface', 'image', 'matching', 'localisation')),
    CHECK (standing IN ('primary', 'redundant', 'view'))
);
COMMENT ON TABLE sds_relation IS 'The relations of the store: the level of the hierarchy each belongs to and whether it can be derived from others.';
COMMENT ON COLUMN sds_relation.relation IS 'name of the table or view';
COMMENT ON COLUMN sds_relation.level IS 'level of the hierarchy: catalogue, run, world, object, part, surface, image, matching or localisation';
COMMENT ON COLUMN sds_relation.standing IS 'primary; redundant: kept for access and derivable from primary relations; or view: derived when it is asked';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('sds_relation', 'catalogue', 'primary');

CREATE TABLE store_schema (
    sha256 TEXT PRIMARY KEY,
    created_at TIMESTAMPTZ NOT NULL DEFAULT CURRENT_TIMESTAMP
);
COMMENT ON TABLE store_schema IS 'The schema that the store was made with, or brought up to: one row.';
COMMENT ON COLUMN store_schema.sha256 IS 'SHA-256 of the SQL files of schema/ for this engine';
COMMENT ON COLUMN store_schema.created_at IS 'when the schema was made in this store';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('store_schema', 'catalogue', 'primary');
