-- What the functions take that a person may call.
-- Takes nothing; gives function_name, argument, type and comment, by function and in their order.
SELECT function_name, argument, type, comment
FROM sds_argument
ORDER BY function_name, argument_no
