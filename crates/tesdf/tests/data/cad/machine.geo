SetFactory("OpenCASCADE");
Sphere(2) = {40,0,0,10};
Cylinder(3) = {0,0,0, 0,0,20, 5};
Cylinder(4) = {0,0,0, 0,0,20, 3};
BooleanDifference(5) = { Volume{3}; Delete; }{ Volume{4}; Delete; };
Save "c.step";
Save "c.iges";
Save "c.brep";
