-- Attribute-value tables: each of what has attributes has one, appended to and never changed, and a view of the newest
-- values.  A paragraph that begins with levels stands for one of each of these.

-- each of part, surface, arc, object, world:
CREATE TABLE {level}_attribute (  -- {at}: Attribute-value table of {things}; appended to, never changed: current_{level}_attribute has the newest value of each.
{columns}
    name TEXT NOT NULL,  -- name of the attribute
    run_id BIGINT NOT NULL,  -- REFERENCES run (id): the run that stated it: the greatest has the newest value
    value_number DOUBLE PRECISION,  -- value, where it is a number
    value_text TEXT,  -- value, where it is text
    value_boolean BOOLEAN,  -- value, where it is true or false
    unit TEXT,  -- unit of a number; null where it has none
    source TEXT NOT NULL,  -- where the value comes from: file, derived, user
    PRIMARY KEY ({key}, name, run_id),
    CHECK (CASE WHEN value_number IS NOT NULL THEN value_text IS NULL AND value_boolean IS NULL
        ELSE (value_text IS NULL) <> (value_boolean IS NULL) AND unit IS NULL END),
    CHECK (source IN ('file', 'derived', 'user'))
);

-- each of part, surface, arc, object, world:
CREATE VIEW current_{level}_attribute (  -- {at}: The newest value of each attribute of {things}.
    {key}, name, value_number, value_text, value_boolean, unit, source, run_id
) AS
SELECT DISTINCT ON ({key}, name) {key}, name, value_number, value_text, value_boolean, unit, source, run_id
FROM {level}_attribute
ORDER BY {key}, name, run_id DESC;
