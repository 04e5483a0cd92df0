// Registration of 3D scans: pairs by ICP, sequences into one consistent cloud.
//
// The cost is the paper's equation 1, with its bucket grid for the closest points (algorithm 1).
// Point-to-plane (Chen and Medioni 1992) and generalised ICP (Segal et al. 2009) are available as well.
//
// Implemented in register_pair.cpp, register_sequence.cpp and registration_input.cpp (fitted_surfel_size).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::cloud {

struct Target {};  ///< frame of the fixed cloud
struct Source {};  ///< frame of the moving cloud

enum class IcpMethod : std::uint8_t {
  point_to_point,
  point_to_plane,
  generalised,
  paper,  ///< point to point over all points, not surfels, in its grid of 28 x 28 x 28 cubes: slow
};

struct RegistrationOptions {
  IcpMethod method = IcpMethod::point_to_plane;
  double max_distance = 1.0;  ///< m, of a pair in the first round; shrinks with the residual
  int max_iterations = 60;    ///< over all resolutions; for the paper's method, over all search radii
  int threads = 0;            ///< 0: all; 1: the serial reference, which gives the same bits
  double surfel_size = 0;     ///< m, of the finest resolution; 0: fitted to the size of the scene
  bool doubt_turns = true;    ///< reject where a quarter turn fits better; false: the guess is more certain
  bool other_starts = true;   ///< where the guess does not converge, also start around it
  double min_overlap = 0.3;   ///< fraction of the source's points that must have a partner
};

/// Result of ICP. `T_target_source` is valid only where `converged`.
struct Registration {
  Transform<Target, Source> T_target_source;
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Identity();  ///< of x, y, z (m), rotation vector (rad), in Target
  bool converged = false;
  std::string why;  ///< reason for not converging, readable text
  /// The only objection is that the surfaces leave directions unconstrained, as a single wall does; the
  /// covariance of those directions is as large as the scene.
  bool undetermined = false;
  double overlap = 0;  ///< fraction of source points with a partner
  double rms = 0;      ///< m, of the pairs' residuals
  int iterations = 0;
};

/// m, the surfel size that is fitted to a cloud; 0 for an empty one. Points are finite.
double fitted_surfel_size(const std::vector<Eigen::Vector3f>& points);

/// Errors: an empty cloud, points that are not finite, options out of range. A bad alignment is not an error:
/// see `converged` and `why`.
Result<Registration> register_pair(const PointCloud<Target>& target, const PointCloud<Source>& source,
                                   const Transform<Target, Source>& guess,
                                   const RegistrationOptions& options = {});

/// One scan of a sequence, with its approximate pose.
struct ScanToRegister {
  std::string name;  ///< of its file, for messages
  PointCloud<Scanner> cloud;
  Transform<Cloud, Scanner> guess;
  bool has_guess = false;  ///< else the result of the previous scan is used
};

struct RegisteredScan {
  Transform<Cloud, Scanner> T_cloud_scan;
  bool converged = false;
  std::string why;
  double overlap = 0, rms = 0, seconds = 0;
};

struct RegisteredSequence {
  PointCloud<Cloud> cloud;  ///< of the scans that converged; scan 0's frame
  std::vector<RegisteredScan> scans;
};

/// Registers each scan against the growing map, then closes loops with a pose graph. `progress` (may be
/// empty) receives the number of finished scans and the total.
Result<RegisteredSequence> register_sequence(
    const std::vector<ScanToRegister>& scans, const RegistrationOptions& options = {},
    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace parhelion::cloud
