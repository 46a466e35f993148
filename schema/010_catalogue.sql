-- The catalogue: what each relation of the store is.
--
-- The loader fills it from the comments in this folder.  The one on a table or view begins with its level, as `part: `,
-- or `part, redundant: ` where it is derivable.  The one on a column that refers begins with the key referred to, as
-- `REFERENCES loop (surface_id, loop_no): `; of several columns it is the last, and the others have the names of the key.

CREATE TABLE sds_relation (  -- catalogue: The relations of the store: the level of the hierarchy each belongs to and whether it can be derived from others.
    relation TEXT PRIMARY KEY,  -- name of the table or view
    level TEXT NOT NULL,  -- level of the hierarchy: catalogue, run, world, object, part, surface, image, matching or localisation
    standing TEXT NOT NULL,  -- primary; redundant: kept for access and derivable from primary relations; or view: derived when it is asked
    CHECK (level IN ('catalogue', 'run', 'world', 'object', 'part', 'surface', 'image', 'matching', 'localisation')),
    CHECK (standing IN ('primary', 'redundant', 'view'))
);

-- Rows, not foreign keys: DuckDB fills the tables of a copy in the order of their names, and deletes no parent in the
-- transaction that deletes its children.
CREATE TABLE sds_reference (  -- catalogue: Which columns refer to the key of which relation: foreign keys on PostgreSQL; relmodel check finds rows whose
    -- reference leads nowhere. Tables without keys, and columns that refer to an occurrence, which is a view, have checks of their own.
    relation TEXT NOT NULL,  -- REFERENCES sds_relation (relation): the relation that refers
    reference_no INTEGER NOT NULL,  -- ordinal of the reference in it
    column_names TEXT[] NOT NULL,  -- its columns that refer; a row where one of them is null refers to nothing
    parent TEXT NOT NULL,  -- REFERENCES sds_relation (relation): the relation referred to
    parent_columns TEXT[] NOT NULL,  -- the key there, in the order of column_names
    PRIMARY KEY (relation, reference_no)
);

CREATE TABLE store (  -- catalogue: Which store this is, so that rows of several stores can lie side by side, and of which schema: one row.
    id TEXT PRIMARY KEY,  -- a random UUID that the store got when it was made or was named as another cell's; a copy of the file has it too
    cell TEXT NOT NULL,  -- name of the cell that the store describes, as relmodel init --cell gives it; else that of its file or database
    schema_sha256 TEXT NOT NULL,  -- SHA-256 of the SQL files of schema/ for this engine that it was made with, or brought up to
    created_at TIMESTAMPTZ NOT NULL DEFAULT CURRENT_TIMESTAMP  -- when it was made
);

CREATE TABLE unit_of_measure (  -- catalogue: The units that relmodel set takes and that views convert by.
    symbol TEXT PRIMARY KEY,  -- how the unit is written
    dimension TEXT NOT NULL,  -- what it measures: length, mass, density ...
    factor DOUBLE PRECISION NOT NULL  -- how many of the store's own unit it is: mm, mm2, mm3, kg, kg/m3, rad, Pa
);

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
