-- Whether the configuration can be changed no more.
-- Takes nothing; gives one value.
SELECT current_setting('lock_configuration') AS locked
