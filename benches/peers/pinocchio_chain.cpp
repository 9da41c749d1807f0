// Inverse dynamics along a record in Pinocchio's C++: seconds of the fastest pass, and the sum of all efforts as a check.
// Input: joints, rows, passes; of each joint mass, centre (3), inertia xx yy zz xy xz yz, translation (3), axis (1 for y, 2 for z);
// then rows of q, v, a.
#include <pinocchio/fwd.hpp>  // first: it sets limits of Boost

#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <ctime>
#include <iostream>
#include <vector>

int main() {
  int joints, rows, passes;
  std::cin >> joints >> rows >> passes;
  pinocchio::Model model;
  model.gravity.linear() << 0.0, 0.0, -9.81;
  pinocchio::JointIndex parent = 0;
  for (int k = 0; k < joints; ++k) {
    double mass, axis;
    Eigen::Vector3d centre, translation;
    double m[6];
    std::cin >> mass >> centre[0] >> centre[1] >> centre[2];
    for (double &entry : m) std::cin >> entry;
    std::cin >> translation[0] >> translation[1] >> translation[2] >> axis;
    Eigen::Matrix3d inertia;
    inertia << m[0], m[3], m[4], m[3], m[1], m[5], m[4], m[5], m[2];
    const pinocchio::SE3 place(Eigen::Matrix3d::Identity(), translation);
    const std::string name = "joint" + std::to_string(k);
    parent = axis == 2 ? model.addJoint(parent, pinocchio::JointModelRZ(), place, name)
                       : model.addJoint(parent, pinocchio::JointModelRY(), place, name);
    model.appendBodyToJoint(parent, pinocchio::Inertia(mass, centre, inertia), pinocchio::SE3::Identity());
  }
  pinocchio::Data data(model);
  std::vector<Eigen::VectorXd> states(3 * rows, Eigen::VectorXd(joints));
  for (auto &state : states)
    for (int k = 0; k < joints; ++k) std::cin >> state[k];
  double best = 1e300, sum = 0.0;
  for (int pass = 0; pass < passes; ++pass) {
    sum = 0.0;
    const std::clock_t begin = std::clock();
    for (int row = 0; row < rows; ++row)
      sum += pinocchio::rnea(model, data, states[3 * row], states[3 * row + 1], states[3 * row + 2]).sum();
    best = std::min(best, double(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  std::cout.precision(17);
  std::cout << best << " " << sum << "\n";
}
