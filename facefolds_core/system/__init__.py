"""The machine beneath: processes, their threads and locks, arrays too large for memory."""
