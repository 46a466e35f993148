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

-- Rows, not foreign keys: DuckDB fills the tables of a copy in the order of their names, and deletes no parent in the
-- transaction that deletes its children.
CREATE TABLE sds_reference (
    relation TEXT NOT NULL,
    reference_no INTEGER NOT NULL,
    column_names TEXT[] NOT NULL,
    parent TEXT NOT NULL,
    parent_columns TEXT[] NOT NULL,
    PRIMARY KEY (relation, reference_no)
);
COMMENT ON TABLE sds_reference IS 'Which columns refer to the key of which relation: foreign keys on PostgreSQL; relmodel check finds rows whose reference leads nowhere. Left out are occurrence and tables without keys, whose rows other checks look after.';
COMMENT ON COLUMN sds_reference.relation IS 'the relation that refers';
COMMENT ON COLUMN sds_reference.reference_no IS 'ordinal of the reference in it';
COMMENT ON COLUMN sds_reference.column_names IS 'its columns that refer; a row where one of them is null refers to nothing';
COMMENT ON COLUMN sds_reference.parent IS 'the relation referred to';
COMMENT ON COLUMN sds_reference.parent_columns IS 'the key there, in the order of column_names';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('sds_relation', 'catalogue', 'primary'),
    ('sds_reference', 'catalogue', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('sds_reference', 0, ARRAY['relation'], 'sds_relation', ARRAY['relation']),
    ('sds_reference', 1, ARRAY['parent'], 'sds_relation', ARRAY['relation']);

CREATE TABLE store_schema (
    sha256 TEXT PRIMARY KEY,
    created_at TIMESTAMPTZ NOT NULL DEFAULT CURRENT_TIMESTAMP
);
COMMENT ON TABLE store_schema IS 'The schema that the store was made with, or brought up to: one row.';
COMMENT ON COLUMN store_schema.sha256 IS 'SHA-256 of the SQL files of schema/ for this engine';
COMMENT ON COLUMN store_schema.created_at IS 'when the schema was made in this store';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('store_schema', 'catalogue', 'primary');

CREATE TABLE store_identity (
    id TEXT PRIMARY KEY,
    cell TEXT NOT NULL
);
COMMENT ON TABLE store_identity IS 'Which store this is, so that rows of several stores can lie side by side: one row, random, of no matter to what is computed.';
COMMENT ON COLUMN store_identity.id IS 'a UUID that the store got when it was made or was named as another cell''s; a copy of the file has it too';
COMMENT ON COLUMN store_identity.cell IS 'the cell that the store is of, as relmodel init --cell names it; else what its file or database is called';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('store_identity', 'catalogue', 'primary');

CREATE TABLE unit_of_measure (
    symbol TEXT PRIMARY KEY,
    dimension TEXT NOT NULL,
    factor DOUBLE PRECISION NOT NULL
);
COMMENT ON TABLE unit_of_measure IS 'The units that relmodel set takes and that views convert by.';
COMMENT ON COLUMN unit_of_measure.symbol IS 'how the unit is written';
COMMENT ON COLUMN unit_of_measure.dimension IS 'what it measures: length, mass, density ...';
COMMENT ON COLUMN unit_of_measure.factor IS 'how many of the store''s own unit it is: mm, mm2, mm3, kg, kg/m3, rad, Pa';

INSERT INTO unit_of_measure (symbol, dimension, factor) VALUES
    ('um', 'length', 0.001),
    ('mm', 'length', 1),
    ('cm', 'length', 10),
    ('m', 'length', 1000),
    ('in', 'length', 25.4),
    ('ft', 'length', 304.8),
    ('mm2', 'area', 1),
    ('cm2', 'area', 100),
    ('m2', 'area', 1e6),
    ('in2', 'area', 645.16),
    ('mm3', 'volume', 1),
    ('cm3', 'volume', 1000),
    ('m3', 'volume', 1e9),
    ('in3', 'volume', 16387.064),
    ('g', 'mass', 0.001),
    ('kg', 'mass', 1),
    ('t', 'mass', 1000),
    ('oz', 'mass', 0.028349523125),
    ('lb', 'mass', 0.45359237),
    ('kg/m3', 'density', 1),
    ('g/cm3', 'density', 1000),
    ('kg/mm3', 'density', 1e9),
    ('lb/in3', 'density', 27679.904710203125),
    ('lb/ft3', 'density', 16.018463373960138),
    ('rad', 'angle', 1),
    ('deg', 'angle', 0.017453292519943295),
    ('Pa', 'pressure', 1),
    ('MPa', 'pressure', 1e6),
    ('GPa', 'pressure', 1e9);

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('unit_of_measure', 'catalogue', 'primary');
