-- Writes the statement that finds rows whose reference leads nowhere, for all references of the catalogue.
-- Takes nothing; gives statement, whose rows have relation, column_names, parent, row_count and one_key, that of one
-- row. Each key that is referred to is joined once, to all that refer to it: a join for each reference takes twice as
-- long.
WITH pair AS (
    SELECT relation, reference_no, parent, array_to_string(parent_columns, ', ') AS parent_key,
        generate_subscripts(column_names, 1) AS place, unnest(column_names) AS name, unnest(parent_columns) AS parent_name
    FROM sds_reference
),
child AS (
    SELECT parent, parent_key,
        concat('SELECT ''', relation, ''' AS relation, ''', string_agg(name, ', ' ORDER BY place), ''' AS column_names, ',
            string_agg(concat(name, ' AS k', place), ', ' ORDER BY place), ' FROM ', relation,
            ' WHERE ', string_agg(concat(name, ' IS NOT NULL'), ' AND ' ORDER BY place)) AS keys,
        string_agg(concat('k', place), ', ' ORDER BY place) AS key,
        string_agg(concat('p.', parent_name, ' = k', place), ' AND ' ORDER BY place) AS meets
    FROM pair
    GROUP BY relation, reference_no, parent, parent_key
),
search AS (
    SELECT concat('SELECT relation, column_names, ''', parent, ''' AS parent, ',
        'count(*) AS row_count, min(concat_ws('', '', ', key, ')) AS one_key ',
        'FROM (', string_agg(keys, ' UNION ALL ' ORDER BY keys), ') AS c ',
        'WHERE NOT EXISTS (SELECT 1 FROM ', parent, ' AS p WHERE ', meets, ') GROUP BY relation, column_names') AS one
    FROM child
    GROUP BY parent, parent_key, key, meets
)
SELECT concat(string_agg(one, ' UNION ALL ' ORDER BY one), ' ORDER BY relation, column_names, parent') AS statement
FROM search
