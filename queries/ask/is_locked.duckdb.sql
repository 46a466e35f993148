-- Whether the configuration can be changed no more.
SELECT current_setting('lock_configuration') AS locked
