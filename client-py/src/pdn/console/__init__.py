"""The operator's side: commands for missions, a live view, and the import of pose graphs.

options, failures <- connection <- words, tables <- mission, questions, watch, import_g2o (with g2o) <-
commands
"""
