-- Runs: everything that wrote into the store, when, from what, and how it ended.

CREATE SEQUENCE run_id_seq;
CREATE TABLE run (  -- run: One execution that writes: a load, a world, an index, an inspection, an attribute that a person sets. What happened in it is in
    -- run_event.
    id BIGINT PRIMARY KEY,  -- identity of the run
    kind TEXT NOT NULL,  -- what was run
    parameters JSON NOT NULL,  -- parameters of the run, defaults and the seeds of its random draws included
    versions JSON NOT NULL,  -- versions of relmodel and of the packages the result depends on
    code_commit TEXT,  -- git commit of the checkout that the code ran from; null where it ran from an installed package
    code_sha256 TEXT NOT NULL,  -- SHA-256 of the program as it ran, of its Python and SQL files: equal for equal code, installed or not, committed or
        -- not
    schema_revision TEXT NOT NULL,  -- revision of the store's schema
    host TEXT NOT NULL,  -- name of the machine
    process BIGINT NOT NULL,  -- process id on that machine, to tell a dead run from a living one
    began_at TIMESTAMPTZ NOT NULL,  -- when the run began
    CHECK (kind IN ('load', 'world', 'index', 'diff', 'extract', 'stereo', 'inspect', 'set', 'prune', 'decide'))
);

CREATE TABLE run_input (  -- run: The files a run read, by content.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    input_no INTEGER NOT NULL,  -- ordinal of the input in the run
    role TEXT NOT NULL,  -- what the file was to the run: model, world, rig, prior; a picture: the name of its camera
    name TEXT NOT NULL,  -- file name as given, without its folder
    sha256 TEXT NOT NULL,  -- SHA-256 of the file's bytes, hexadecimal
    PRIMARY KEY (run_id, input_no)
);

CREATE TABLE run_event (  -- run: What happened in a run, appended in order; run_state has the state that each run is in.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run
    event_no INTEGER NOT NULL,  -- ordinal of the event in the run
    kind TEXT NOT NULL,  -- begun, step (a step of the run ended), ended, or found_dead (its process was gone)
    name TEXT NOT NULL,  -- name of the step; empty for the others
    seconds DOUBLE PRECISION,  -- how long the step or the run took, s; those of the steps add up to that of the run
    state TEXT,  -- how the run ended: finished (it did what it was asked, whatever the verdict), failed (bad input or an error) or killed (its
        -- process was gone); null of what happened before
    cause TEXT,  -- of a run that failed: input (what it was given is bad: no more than tried) or error; null of all else
    message TEXT,  -- the error or the reason, one sentence
    happened_at TIMESTAMPTZ NOT NULL,  -- when it happened: of a step, when the step ended
    PRIMARY KEY (run_id, event_no),
    CHECK (kind IN ('begun', 'step', 'ended', 'found_dead')),
    CHECK ((state IS NOT NULL) = (kind IN ('ended', 'found_dead'))),
    CHECK (cause IN ('input', 'error')),
    CHECK (CASE kind WHEN 'ended' THEN state IN ('finished', 'failed') ELSE state = 'killed' END)
);

CREATE TABLE ledger (  -- run: How many rows each transaction of a run committed into each relation, or took from it; relmodel check compares it with
    -- the tables.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that wrote
    write_no INTEGER NOT NULL,  -- ordinal of the transaction in the run, from 0
    relation TEXT NOT NULL,  -- REFERENCES sds_relation (relation): the table written to
    row_count BIGINT NOT NULL,  -- rows appended; below 0: rows taken, by a run of kind prune
    PRIMARY KEY (run_id, write_no, relation),
    CHECK (row_count <> 0)
);

CREATE TABLE row_digest (  -- run: Digests of the rows that an inspection rests on, its own and those of the extractions that it read, as they were when it
    -- ended; relmodel check compares them with the tables.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the inspection
    relation TEXT NOT NULL,  -- REFERENCES sds_relation (relation): the table
    digest TEXT NOT NULL,  -- exclusive or over 64-bit hashes of the texts of the rows, times left out: of this engine, and of the columns that the
        -- table has
    PRIMARY KEY (run_id, relation)
);

CREATE TABLE pruned_run (  -- run: Runs whose rows were taken to make room; the run itself, its inputs, events and ledger stay.
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that was pruned
    what TEXT NOT NULL,  -- runs: all that it found; pictures: the bytes of its pictures
    by_run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run of kind prune that did it
    PRIMARY KEY (run_id, what),
    CHECK (what IN ('runs', 'pictures'))
);

CREATE SEQUENCE source_id_seq;
CREATE TABLE source (  -- run: A file that a model was loaded from, by content.
    id BIGINT PRIMARY KEY,  -- identity of the source
    file_name TEXT NOT NULL,  -- name of the file as first given, without its folder
    sha256 TEXT NOT NULL,  -- SHA-256 of the file's bytes, hexadecimal
    format TEXT NOT NULL,  -- step, obj, stl, ply, glb, ...
    schema_name TEXT,  -- schema that the file itself declares, such as AP242
    unit TEXT NOT NULL,  -- length unit of the file
    unit_mm DOUBLE PRECISION NOT NULL,  -- that unit in mm
    loader_version TEXT NOT NULL,  -- version of the loader that read it
    UNIQUE (sha256, unit_mm, loader_version),
    CHECK (unit_mm > 0)
);
