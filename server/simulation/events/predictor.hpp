// Predicts collisions, near misses and tipping of real and simulated robots, after each step.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "server/simulation/bodies/prediction.hpp"
#include "server/simulation/events/contacts.hpp"
#include "server/simulation/world/surroundings.hpp"

namespace parhelion::simulation {

class Predictor {
 public:
  /// `robot`: one of around.real_robots that is present.
  void predict(RealRobot& robot, const ObservedMotion& motion, const Surroundings& around,
               const Contacts& contacts, std::vector<Event>& events);
  /// `agent`: one of around.agents, with a robot model.
  void predict(Agent& agent, const ObservedMotion& motion, const Surroundings& around,
               const Contacts& contacts, std::vector<Event>& events);
  /// Reserves memory for a building of this many obstacles, so that no step allocates any.
  void reserve(std::size_t obstacles) { near_.reserve(4 * obstacles); }

 private:
  /// The robot to check, and its parameters.
  struct PredictionQuery {
    const std::string* name;
    MovingFootprint own;
    const Footprint& placed;
    Eigen::Vector2d center;
    double margin;       ///< m from the building that counts as contact
    double bottom, top;  ///< m, z range of possible obstacles
    double climb;        ///< m over `bottom`, maximum height of steps that are not obstacles
    bool is_virtual, undetectable;
    double speed;           ///< m/s of its fastest point
    const RealRobot* real;  ///< the robot, if it is real; else nullptr...
    const Agent* agent;     ///< ...and the agent
    NearMissWatch& misses;
    const Surroundings& around;
    const Contacts& contacts;
    SimulationTime now() const { return around.clock.now(); }
    /// Fast enough for a near miss of its own.
    bool moves() const { return speed > NearMissWatch::kMinSpeed; }
  };
  /// Another body on the path.
  struct OtherBody {
    MovingFootprint moving;
    const Footprint& placed;
    const std::string& name;
    bool is_virtual, undetectable;
  };

  void predict_collisions(const PredictionQuery& query, const Supervised& body, const ObservedMotion& motion,
                          RobotPrediction& prediction, std::vector<Event>& events);
  std::optional<Ahead> find_first_collision(const PredictionQuery& query);
  void predict_building_collision(const PredictionQuery& query, std::optional<Ahead>& ahead);
  static void predict_agent_collision(const PredictionQuery& query, const Agent& other,
                                      std::optional<Ahead>& ahead);
  static void predict_real_collision(const PredictionQuery& query, const RealRobot& other,
                                     std::optional<Ahead>& ahead);
  static void predict_body_collision(const PredictionQuery& query, const OtherBody& other,
                                     std::optional<Ahead>& ahead);
  static void check_passing_distance(const PredictionQuery& query, const Footprint& placed,
                                     const std::string& name, PairKind pair, bool undetectable);

  std::vector<const FixedObstacle*> near_;  // reused memory
};

}  // namespace parhelion::simulation
