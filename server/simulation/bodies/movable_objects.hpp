// Movable objects of a site's model (chairs, tables, boxes, bins) as free bodies, at levels 1 and 2: an agent
// of kind box with a form of its own.
#pragma once

#include <vector>

#include "protocols/agent.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/bodies/bodies.hpp"

namespace parhelion::simulation {

/// Takes the objects that can be bodies out of `model`, with their meshes, and puts each where a body can
/// rest: on the floor or the object under it, and beside walls that its box reaches into. The others stay
/// fixed parts of the model: not movable, smaller than 5 cm or larger than 2.5 m, heavier than 300 kg, on
/// nothing known, deeper than 15 cm in a floor or a wall, or with an entity's name. Error: an entity that is
/// not finite.
Result<std::vector<ModelObject>> take_movable(SemanticModel& model, const std::vector<ModelObject>& objects);

/// Its name and size, its mass from the density of its kind, its pose (z: of its underside).
AgentDefinition object_agent(const ModelObject& object);

/// Chairs and tables collide as boxes for seat, back, top and legs, which robots can drive between; others as
/// their box. A chair's back is where its mesh is high; without a mesh at -x.
AgentForm object_form(const ModelObject& object);

/// Its mesh, or without one what collides; origin in the middle of its underside.
BodyDefinition object_body(const ModelObject& object, BodyId id);

}  // namespace parhelion::simulation
