"""The operator's side: commands for missions, a live view, and the import of pose graphs.

options, failures <- planner <- formatting, tables, dashboard <- mission, questions, watch, import_g2o <-
commands
"""
