-- The references of the catalogue as foreign keys.

DO $$
BEGIN
    EXECUTE (
        SELECT string_agg(
            concat('ALTER TABLE ', relation, ' ADD FOREIGN KEY (', array_to_string(column_names, ', '),
                ') REFERENCES ', parent, ' (', array_to_string(parent_columns, ', '), ')'),
            '; ' ORDER BY relation, reference_no)
        FROM sds_reference
    );
END
$$;
