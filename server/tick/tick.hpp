// The whole server: one input in, its outputs out. Reads no clock, takes no lock, does no I/O.
#pragma once

#include "protocols/bus/bus.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/frame_answer.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/state.hpp"

namespace parhelion::tick {

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
/// door_path.cpp: where real doors stand, by the scan that was answered. `sigma`: m, 1 sigma of where a
/// return lies in the map.
void sight_doors(const Configuration& configuration, const scan::LaserMotion& laser, double sigma,
                 State& state);
/// camera_path.cpp: CAMERA to a job for the render thread, or to MR_CAMERA at once with the reason.
void answer_image(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
/// The simulated robot's cameras at the newest step: a job for the render thread.
void take_picture(const Configuration& configuration, const simulation::RobotMotion& motion,
                  SimulationTime now, State& state, Outputs& outputs);
/// What the render thread's answer leads to: MR_CAMERA, and MR_DEPTH where there is one; of simulated
/// cameras CAMERA and DEPTH and, as they are, MR_CAMERA and MR_DEPTH.
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
/// instructor_path.cpp: what an instructor asks for.
void process_command(const Configuration& configuration, const Message& input, State& state,
                     Outputs& outputs);
/// command_path.cpp: the trainee's commands.
void answer_teleop(const Configuration& configuration, const Message& input, State& state, Outputs& outputs);
void answer_joint_command(const Configuration& configuration, const Message& input, State& state,
                          Outputs& outputs);
/// The emergency stop of the trainee's robot. Engaged: no command goes out but the stop. What moves joints is
/// held as well, until whoever moves them has let go.
void set_emergency_stop(const Configuration& configuration, bool engaged, SimulationTime now, State& state,
                        Outputs& outputs);
/// Nothing moves that robot any more until it is driven again.
void stop_robot(const Configuration& configuration, const std::string& robot, ArrivalTime now, State& state,
                Outputs& outputs);
void drive_agent(const Configuration& configuration, const Message& input, std::string_view agent,
                 State& state);
/// command_path.cpp: MR_CMD stops when TELEOP has been silent for too long, and so does MR_JOINT_CMD; that
/// silence is a released dead-man.
void watch_silence(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// instructor_path.cpp: does the command, or says why not.
Status do_agent_command(const Configuration& configuration, const AgentCommand& command, State& state,
                        Outputs& outputs);
/// script_path.cpp: what the scenario's scripts do at the newest step.
void run_scripts(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// operator_path.cpp: whom an operator drives; the robot that is left, or whose console is lost, stops.
void take_operator_word(const Configuration& configuration, const Message& input, State& state,
                        Outputs& outputs);
/// A console that has said nothing for a second is lost.
void watch_operators(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// Somebody else's message on a channel that the simulated robot's sensors speak on: an event. `channel`:
/// index in sensor_channels().
void note_foreign_message(const Configuration& configuration, SimulationTime now, std::int64_t channel,
                          State& state, Outputs& outputs);
/// laser_path.cpp: what the laser measures at the newest step, the scan's stamp being the last beam's; its
/// hits are left in the first bench of state.agent_laser, of bodies of its only job's sweep. False: the world
/// at that instant is not known.
bool simulate_laser(const Configuration& configuration, const simulation::LaserRequest& request, State& state,
                    Scan& scan);
/// The scans of all state.laser_requests, for the agents' behaviour and for whoever listens.
void answer_lasers(const Configuration& configuration, State& state, Outputs& outputs);
/// fault_path.cpp: a lesson that begins or ends is an event; dead wheels of the simulated robot stop
/// turning.
void watch_lessons(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// The instructor begins a fault, or ends one. Error: an amount out of range, or a kind that only simulated
/// robots can have.
Status process_fault_command(const Configuration& configuration, const FaultCommand& command,
                             SimulationTime now, State& state);
/// Of the trainee's simulated laser: beams that see nothing.
void drop_beams(const Configuration& configuration, State& state, Scan& scan);
/// sensor_path.cpp: what the sensors of a simulated trainee's robot measure at the newest step: outputs that
/// are taken in at once, as a real robot's are when they arrive. Nothing at level 3.
void publish_sensors(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// The trainee's robot into the world, with its sensors. Nothing at level 3.
Status spawn_trainee(const Configuration& configuration, State& state);
/// What a message of this kind leads to, the physics being where it should be. `agent`: of agent_teleop.
void take_input(const Configuration& configuration, InputKind kind, std::string_view agent,
                const Message& input, State& state, Outputs& outputs, StageObserver& observer);
/// injection_path.cpp: what the robot's sensors show of what is virtual. A change between live and degraded
/// (`reason` not empty) is an event, and so is the first word.
void note_injection(const Configuration& configuration, SimulationTime now, const std::string& reason,
                    State& state, Outputs& outputs);
/// At each step: what the injection gate has withheld or shown again, and a real robot's SCAN that has not
/// come for a while, or not yet.
void watch_injection(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs);
/// Whether the newest scan was answered with the truth, and not long ago.
bool injection_is_live(const State& state, SimulationTime now);
/// physics_path.cpp: what the physics says, to MR_EVENTS and MR_WORLD.
void publish_event(const Configuration& configuration, const Event& event, State& state, Outputs& outputs);
void publish_simulation_events(const Configuration& configuration, State& state, Outputs& outputs);

/// What goes out in place of an answer that came too late: the raw scan, and why.
void substitute_raw_scan(const Configuration& configuration, const Message& input, State& state,
                         Outputs& outputs);

/// Counts a message that was not understood.
void refuse(const Error& error, State& state);

}  // namespace parhelion::tick
