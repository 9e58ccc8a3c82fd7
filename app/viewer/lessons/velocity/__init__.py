"""The lesson "Velocity": the Jacobian at the present configuration, and the directions lost at singularities."""
