"""The protocol of clients and solver nodes: values, and their XML. Needs no clingo."""
