// This robot's dimensions and limits. robot.yaml describes the same robot to Parhelion: change both.
#pragma once

#include "geometry.hpp"

namespace robot {

inline const Polygon kFootprint = {{-0.28, -0.20}, {0.22, -0.20}, {0.22, 0.20}, {-0.28, 0.20}};  // base_link
constexpr double kRadius = 0.35;                      // m, that its corners reach
constexpr double kHeight = 0.6;                       // m
constexpr double kMaxSpeed = 0.7, kMaxYawRate = 1.4;  // m/s, rad/s
constexpr double kDeceleration = 1.0;                 // m/s^2
constexpr double kYawDeceleration = 3.0;              // rad/s^2
constexpr double kReactionTime = 0.15;                // s from a command to the motion

constexpr double kWheelRadius = 0.1, kTrack = 0.38;  // m
constexpr double kTicksPerTurn = 2048;               // of a wheel's encoder

constexpr Pose2 kLaserPose{0.1, 0, 0};  // T_base_laser
constexpr double kLaserHeight = 0.3;    // m over the floor
constexpr int kBeams = 360;
constexpr double kAngleMin = -kPi, kAngleStep = 2 * kPi / kBeams;  // rad
constexpr double kBeamInterval = 0.0002, kScanPeriod = 0.1;        // s
constexpr double kRangeMin = 0.05, kRangeMax = 25;                 // m
constexpr double kRangeNoise = 0.008, kRangeStep = 0.001;          // m, 1 sigma; quantization

constexpr double kCameraX = 0.15, kCameraHeight = 0.5;  // m, T_base_camera: looks forward, level
constexpr int kImageWidth = 160, kImageHeight = 120;    // pixels
constexpr double kFocalLength = 120;                    // pixels
constexpr double kDepthMin = 0.3, kDepthMax = 6;        // m

}  // namespace robot
