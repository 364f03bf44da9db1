"""Input of Kratos' DEM application."""

MDPA = """Begin ModelPartData
 //  VARIABLE_NAME value
End ModelPartData

 Begin Properties 0
 End Properties

Begin Nodes
7 0.5 0.25 0.125 // the first
3 0.75 0.25 0.125
9 1 2 3
End Nodes

Begin Elements SphericParticle3D// GUI group identifier: Body
1  0 3
2  0 7
End Elements

Begin NodalData RADIUS // GUI group identifier: Body
3  0 0.1
7  1 0.2
End NodalData

Begin NodalData COHESIVE_GROUP
3  0 5
End NodalData

Begin SubModelPart DEMParts_Body
 Begin SubModelPartNodes
3
 End SubModelPartNodes
End SubModelPart
"""
