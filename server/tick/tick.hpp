// The server as one function: one input in, its outputs out. Reads no clock, takes no lock, does no I/O.
//
// tick() passes each message to the path of its kind, with the state that this path needs:
//   SCAN                      scan_path            MR_SPAWN, MR_DOOR, ...    instructor_path
//   CAMERA, DEPTH             camera_path          TELEOP, JOINT_CMD         command_path
//   ODOMETRY, IMU, POSE, ...  pose_path            OPERATOR                  operator_path
//   MR_MODEL                  model_path           LOOP                      tick.cpp
// advance() (physics_path) does the steps between two inputs. Results of the render thread go through
// frame_path.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/frame_path.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/physics_path.hpp"
#include "server/tick/state.hpp"

namespace parhelion::tick {

/// Handles one input. Arrivals must strictly increase. All physics steps due at or before the arrival are
/// done first. Bad input is refused and counted, and never throws. `sink` receives MR_SCAN.
void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages, ScanSink& sink);

/// The same, with MR_SCAN among the other outputs.
void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages);

/// At the end of a session: stops each robot that was driven, and processes an image that still waits for its
/// depth image.
void finish(const Configuration& configuration, State& state, Outputs& outputs);

}  // namespace parhelion::tick
