// Prints the best grasp of a summary.json. Boost's headers are all it needs:
//   c++ -std=c++17 -o read_grasp read_grasp.cpp && ./read_grasp results/can/summary.json

#include <boost/property_tree/json_parser.hpp>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

using Tree = boost::property_tree::ptree;

std::vector<double> numbers(const Tree& node) {
  std::vector<double> values;
  for (const auto& item : node) values.push_back(item.second.get_value<double>());
  return values;
}

struct Finger {
  std::vector<double> target;  // x y z [m]
  double gain;                 // [N/m]
};

struct Grasp {
  std::vector<double> wrist;             // x y z [m] qx qy qz qw of the hand's root link, in the world
  std::map<std::string, double> joints;  // [rad]
  std::map<std::string, Finger> fingers;
};

Grasp best(const std::string& file) {
  Tree summary;
  read_json(file, summary);
  const Tree& tree = summary.get_child("best");
  if (!tree.count("wrist")) return {};  // null: no start is feasible
  Grasp grasp{numbers(tree.get_child("wrist")), {}, {}};
  for (const auto& joint : tree.get_child("joints")) grasp.joints[joint.first] = joint.second.get_value<double>();
  for (const auto& finger : tree.get_child("fingers"))
    grasp.fingers[finger.first] = {numbers(finger.second.get_child("target")), finger.second.get<double>("gain")};
  return grasp;
}

int main(int count, char** arguments) {
  if (count != 2) return std::fprintf(stderr, "usage: read_grasp summary.json\n"), 2;
  const Grasp grasp = best(arguments[1]);
  if (grasp.wrist.empty()) return std::puts("no start is feasible"), 1;
  std::printf("wrist");
  for (double value : grasp.wrist) std::printf(" %.6f", value);
  std::puts("");
  for (const auto& [name, angle] : grasp.joints) std::printf("%s %.6f\n", name.c_str(), angle);
  for (const auto& [name, finger] : grasp.fingers)
    std::printf("%s %.6f %.6f %.6f %.3f\n", name.c_str(), finger.target[0], finger.target[1], finger.target[2],
                finger.gain);
}
