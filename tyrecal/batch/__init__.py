"""Many cases at once: each case a task, all studies of it in a row; drift; JUnit."""
