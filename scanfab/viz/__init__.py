"""What is looked at: figures, ParaView files, the 3D window, the report."""
