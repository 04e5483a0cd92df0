// The whole server: one input in, its outputs out. Reads no clock, takes no lock, does no I/O.
//
// tick() hands each message to the path of its kind, with the part of the state that the path works on:
//   SCAN                      scan_path            MR_SPAWN, MR_DOOR, ...    instructor_path
//   CAMERA, DEPTH             camera_path          TELEOP, JOINT_CMD         command_path
//   ODOMETRY, IMU, POSE, ...  pose_path            OPERATOR                  operator_path
//   MR_MODEL                  model_path           LOOP                      tick.cpp
// advance() (physics_path) does the steps between two inputs. What the render thread has finished goes
// through frame_path.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/frame_path.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/physics_path.hpp"
#include "server/tick/state.hpp"

namespace parhelion::tick {

/// Handles one input. Its arrival must be later than that of every input before. All physics steps due at or
/// before it are done first. Bad input is refused and counted, and never throws. `sink` gets MR_SCAN.
void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages, ScanSink& sink);

/// The same where MR_SCAN goes out with the other outputs.
void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& stages);

/// At the end of a session: an image that still waits for its depth image is answered.
void finish(const Configuration& configuration, State& state, Outputs& outputs);

}  // namespace parhelion::tick
