-- Runs: everything that wrote into the store, when, from what, and how it ended.

CREATE SEQUENCE run_id_seq;
CREATE TABLE run (
    id BIGINT PRIMARY KEY,
    kind TEXT NOT NULL,
    parameters JSON NOT NULL,
    versions JSON NOT NULL,
    code_commit TEXT,
    code_sha256 TEXT NOT NULL,
    schema_revision TEXT NOT NULL,
    host TEXT NOT NULL,
    process BIGINT NOT NULL,
    began_at TIMESTAMPTZ NOT NULL,
    CHECK (kind IN ('load', 'world', 'index', 'diff', 'extract', 'stereo', 'inspect', 'set', 'prune'))
);
COMMENT ON TABLE run IS 'One execution that writes: a load, a world, an index, an inspection, an attribute that a person sets. What happened in it is in run_event.';
COMMENT ON COLUMN run.id IS 'identity of the run';
COMMENT ON COLUMN run.kind IS 'what was run';
COMMENT ON COLUMN run.parameters IS 'parameters of the run, defaults and the seeds of its random draws included';
COMMENT ON COLUMN run.versions IS 'versions of relmodel and of the packages the result depends on';
COMMENT ON COLUMN run.code_commit IS 'git commit of the checkout that the code ran from; null where it ran from an installed package';
COMMENT ON COLUMN run.code_sha256 IS 'SHA-256 of the program as it ran, of its Python and SQL files: equal for equal code, installed or not, committed or not';
COMMENT ON COLUMN run.schema_revision IS 'revision of the store''s schema';
COMMENT ON COLUMN run.host IS 'name of the machine';
COMMENT ON COLUMN run.process IS 'process id on that machine, to tell a dead run from a living one';
COMMENT ON COLUMN run.began_at IS 'when the run began';

CREATE TABLE run_input (
    run_id BIGINT NOT NULL,
    input_no INTEGER NOT NULL,
    role TEXT NOT NULL,
    name TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    PRIMARY KEY (run_id, input_no)
);
COMMENT ON TABLE run_input IS 'The files a run read, by content.';
COMMENT ON COLUMN run_input.run_id IS 'the run';
COMMENT ON COLUMN run_input.input_no IS 'ordinal of the input in the run';
COMMENT ON COLUMN run_input.role IS 'what the file was to the run: model, world, rig, prior, left, right';
COMMENT ON COLUMN run_input.name IS 'file name as given, without its folder';
COMMENT ON COLUMN run_input.sha256 IS 'SHA-256 of the file''s bytes, hexadecimal';

CREATE TABLE run_event (
    run_id BIGINT NOT NULL,
    event_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    name TEXT NOT NULL,
    seconds DOUBLE PRECISION,
    state TEXT,
    message TEXT,
    happened_at TIMESTAMPTZ NOT NULL,
    PRIMARY KEY (run_id, event_no),
    CHECK (kind IN ('begun', 'step', 'ended', 'found_dead')),
    CHECK ((state IS NOT NULL) = (kind IN ('ended', 'found_dead'))),
    CHECK (CASE kind WHEN 'ended' THEN state IN ('finished', 'failed') ELSE state = 'killed' END)
);
COMMENT ON TABLE run_event IS 'What happened in a run, appended in order; run_state has the state that each run is in.';
COMMENT ON COLUMN run_event.run_id IS 'the run';
COMMENT ON COLUMN run_event.event_no IS 'ordinal of the event in the run';
COMMENT ON COLUMN run_event.kind IS 'begun, step (a step of the run ended), ended, or found_dead (its process was gone)';
COMMENT ON COLUMN run_event.name IS 'name of the step; empty for the others';
COMMENT ON COLUMN run_event.seconds IS 'how long the step or the run took, s; those of the steps add up to that of the run';
COMMENT ON COLUMN run_event.state IS 'how the run ended: finished (it did what it was asked, whatever the verdict), failed (bad input or an error) or killed (its process was gone); null of what happened before';
COMMENT ON COLUMN run_event.message IS 'the error or the reason, one sentence';
COMMENT ON COLUMN run_event.happened_at IS 'when it happened: of a step, when the step ended';

CREATE TABLE ledger (
    run_id BIGINT NOT NULL,
    write_no INTEGER NOT NULL,
    relation TEXT NOT NULL,
    row_count BIGINT NOT NULL,
    PRIMARY KEY (run_id, write_no, relation),
    CHECK (row_count <> 0)
);
COMMENT ON TABLE ledger IS 'How many rows each transaction of a run committed into each relation, or took from it; relmodel check holds it against the tables.';
COMMENT ON COLUMN ledger.run_id IS 'the run that wrote';
COMMENT ON COLUMN ledger.write_no IS 'ordinal of the transaction in the run, from 0';
COMMENT ON COLUMN ledger.relation IS 'the table written to';
COMMENT ON COLUMN ledger.row_count IS 'rows appended; below 0: rows taken, by a run of kind prune';

CREATE TABLE row_digest (
    run_id BIGINT NOT NULL,
    relation TEXT NOT NULL,
    digest TEXT NOT NULL,
    PRIMARY KEY (run_id, relation)
);
COMMENT ON TABLE row_digest IS 'Digests of the rows that an inspection rests on, its own and those of the extractions that it read, as they were when it ended; relmodel check holds them against the tables.';
COMMENT ON COLUMN row_digest.run_id IS 'the inspection';
COMMENT ON COLUMN row_digest.relation IS 'the table';
COMMENT ON COLUMN row_digest.digest IS 'exclusive or over 64-bit hashes of the texts of the rows, times left out: of this engine, and of the columns that the table has';

CREATE TABLE pruned_run (
    run_id BIGINT NOT NULL,
    what TEXT NOT NULL,
    by_run_id BIGINT NOT NULL,
    PRIMARY KEY (run_id, what),
    CHECK (what IN ('runs', 'pictures'))
);
COMMENT ON TABLE pruned_run IS 'Runs whose rows were taken to make room; the run itself, its inputs, events and ledger stay.';
COMMENT ON COLUMN pruned_run.run_id IS 'the run that was pruned';
COMMENT ON COLUMN pruned_run.what IS 'runs: all that it found; pictures: the bytes of its pictures';
COMMENT ON COLUMN pruned_run.by_run_id IS 'the run of kind prune that did it';

CREATE SEQUENCE source_id_seq;
CREATE TABLE source (
    id BIGINT PRIMARY KEY,
    file_name TEXT NOT NULL,
    sha256 TEXT NOT NULL,
    format TEXT NOT NULL,
    schema_name TEXT,
    unit TEXT NOT NULL,
    unit_mm DOUBLE PRECISION NOT NULL,
    loader_version TEXT NOT NULL,
    UNIQUE (sha256, unit_mm, loader_version),
    CHECK (unit_mm > 0)
);
COMMENT ON TABLE source IS 'A file that a model was loaded from, by content.';
COMMENT ON COLUMN source.id IS 'identity of the source';
COMMENT ON COLUMN source.file_name IS 'name of the file as first given, without its folder';
COMMENT ON COLUMN source.sha256 IS 'SHA-256 of the file''s bytes, hexadecimal';
COMMENT ON COLUMN source.format IS 'step, obj, stl, ply, glb, ...';
COMMENT ON COLUMN source.schema_name IS 'schema that the file itself declares, such as AP242';
COMMENT ON COLUMN source.unit IS 'length unit of the file';
COMMENT ON COLUMN source.unit_mm IS 'that unit in mm';
COMMENT ON COLUMN source.loader_version IS 'version of the loader that read it';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('run', 'run', 'primary'),
    ('run_input', 'run', 'primary'),
    ('run_event', 'run', 'primary'),
    ('ledger', 'run', 'primary'),
    ('row_digest', 'run', 'primary'),
    ('pruned_run', 'run', 'primary'),
    ('source', 'run', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('run_input', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('run_event', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('ledger', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('ledger', 1, ARRAY['relation'], 'sds_relation', ARRAY['relation']),
    ('row_digest', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('row_digest', 1, ARRAY['relation'], 'sds_relation', ARRAY['relation']),
    ('pruned_run', 0, ARRAY['run_id'], 'run', ARRAY['id']),
    ('pruned_run', 1, ARRAY['by_run_id'], 'run', ARRAY['id']);
