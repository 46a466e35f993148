-- Whether the configuration is locked.
-- Takes nothing; gives one value.
SELECT current_setting('lock_configuration') AS locked
