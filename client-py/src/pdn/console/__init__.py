"""The operator's side: commands for missions, a live view, and pose graphs in and out.

options, failures <- planner <- formatting, tables, dashboard <- mission, questions, watch <- commands
pose_graph (files) <- import_stream <- import_report, import_refused <- import_graph <- commands
import_options, import_mission <- import_graph; journal_file, pose_graph <- export_* <- export <- commands
"""
