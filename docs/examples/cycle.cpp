// One cycle of the controller at the pregrasp; a robot's loop runs it with measured states.
#include <cstdio>
#include <sgnlp/controller.hpp>

int main(int, char** arguments) {
  sgnlp::Controller controller = sgnlp::Controller::load(arguments[1]);
  const Eigen::VectorXd joints = controller.pregrasp(), speeds = 0.0 * joints;  // read from the hand
  const Eigen::Quaterniond wrist(controller.wrist().tail<4>().eval());          // x y z w, from the arm
  const double seconds = 0.0;                                                  // since closing began
  const Eigen::VectorXd& torques = controller.torques(seconds, wrist, joints, speeds);
  for (int i = 0; i < torques.size(); ++i) std::printf("%s %.6f\n", controller.names()[i].c_str(), torques[i]);
}
