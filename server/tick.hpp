// The whole server: one input in, its outputs out. Reads no clock, takes no lock, does no I/O.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/configuration.hpp"
#include "server/outputs.hpp"
#include "server/render_thread.hpp"
#include "server/state.hpp"

namespace parhelion {

/// Handles one input. Its arrival must be later than that of every input before. All physics steps due at or
/// before it are done first. Bad input is refused and counted, and never throws.
void tick(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
          StageObserver& observer);

/// Does the physics steps due at or before `until`: what a timer calls, and tick before it handles an input.
void advance(const Configuration& configuration, ArrivalTime until, State& state, Outputs& outputs,
             StageObserver& observer);

// The ways of the data, each in a file of its own name.

/// scan_path.cpp: SCAN to MR_SCAN and MR_SCAN_INFO.
void answer_scan(const Configuration& configuration, const Message& input, State& state, Outputs& outputs,
                 StageObserver& observer);
/// camera_path.cpp: CAMERA to a job for the render thread, or to MR_CAMERA at once with the reason.
void answer_image(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
/// What the render thread's answer leads to: MR_CAMERA, and MR_DEPTH where there is one.
void add_frame_outputs(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                       State& state);
void take_depth(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
/// model_path.cpp: MR_MODEL, the building as it is known from now on.
void change_model(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
/// At the end of a session: what still waits is answered.
void flush_images(const Configuration& configuration, State& state, Outputs& outputs);
/// An image waits at most 50 ms for the depth image of its moment; drivers send colour first.
void watch_waiting_image(const Configuration& configuration, SimulationTime now, State& state,
                         Outputs& outputs);
/// command_path.cpp: the instructor's and the trainee's commands.
void answer_agent_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs);
void answer_teleop(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
void answer_joint_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs);
void drive_agent(const Message& input, std::string_view agent, State& state);
/// command_path.cpp: MR_CMD stops when TELEOP has been silent for too long, and so does MR_JOINT_CMD.
void watch_silence(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// command_path.cpp: does the command, or says why not.
Status do_agent_command(const Configuration& configuration, const AgentCommand& command, State& state,
                        Outputs& outputs);
/// script_path.cpp: what the scenario's scripts do at the newest step.
void run_scripts(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// physics_path.cpp: what the physics says, to MR_EVENTS and MR_WORLD.
void publish_event(const Configuration& configuration, const Event& event, State& state, Outputs& outputs);
void publish_simulation_events(const Configuration& configuration, State& state, Outputs& outputs);

/// What goes out in place of an answer that came too late: the raw scan, and why.
void substitute_raw_scan(const Configuration& configuration, const Message& input, State& state,
                         Outputs& outputs);

/// Counts a message that was not understood.
void refuse(const Error& error, State& state);

}  // namespace parhelion
