diagnose_record: w.csv:1: empty, expected column names
Command exited with non-zero status 65
0.01
