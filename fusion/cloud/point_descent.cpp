#include "fusion/cloud/point_descent.hpp"

#include <algorithm>

#include "fusion/cloud/point_icp.hpp"

namespace parhelion::cloud {

Descent descend_points(const PointCloud<Target>& target, const PointCloud<Source>& source,
                       const Level& verdict, const Eigen::Isometry3d& guess,
                       const RegistrationOptions& options) {
  Descent result{guess, verdict.options, {verdict.target, verdict.source, verdict.options.gate}};
  const double small = verdict.source.size / 500;  // m; closed-form steps become very small at the end
  const Eigen::Vector3d middle = source.points[source.size() / 2].cast<double>();
  for (double reach = options.max_distance;; reach = std::max(reach / 2, verdict.options.gate)) {
    PointIcp icp(target.points, source.points,
                 {.max_distance = reach, .paper_grid = true, .threads = options.threads});
    result.settled = false;
    while (!result.settled && result.iterations < options.max_iterations) {
      const Eigen::Isometry3d next = icp.step(result.T);
      result.last_step = (next * middle - result.T * middle).norm();
      const double turn = Eigen::AngleAxisd(result.T.linear().transpose() * next.linear()).angle();
      result.settled = result.last_step < small && turn < small / 3;
      result.T = next;
      ++result.iterations;
    }
    if (reach <= verdict.options.gate || !result.settled) break;
  }
  find_partners(result.partners, verdict.source, result.T, options.threads);
  return result;
}

}  // namespace parhelion::cloud
