// Reads a file of a controller, then states from standard input, and prints setpoints and torques of each.
// It ends with 3 if a cycle allocates.
#define EIGEN_RUNTIME_NO_MALLOC
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <new>
#include <sgnlp/controller.hpp>
#include <string>

static bool counting = false;
static long allocations = 0;

void* operator new(std::size_t size) {
  if (counting) ++allocations;
  if (void* made = std::malloc(size)) return made;
  throw std::bad_alloc();
}
void operator delete(void* made) noexcept { std::free(made); }
void operator delete(void* made, std::size_t) noexcept { std::free(made); }

int main(int, char** arguments) try {
  sgnlp::Controller controller = sgnlp::Controller::load(arguments[1]);
  const int n = static_cast<int>(controller.names().size());
  double time;
  Eigen::Matrix<double, 7, 1> wrist;
  Eigen::VectorXd joints(n), speeds(n);
  const auto fill = [](auto& values) {
    std::string word;
    for (double& value : values) std::cin >> word, value = std::stod(word);  // nan, too, which >> does not read
  };
  while (std::cin >> time) {
    fill(wrist), fill(joints), fill(speeds);
    counting = true;
    Eigen::internal::set_is_malloc_allowed(false);
    const Eigen::VectorXd& torques =
        controller.torques(time, Eigen::Quaterniond(wrist[6], wrist[3], wrist[4], wrist[5]), joints, speeds);
    const Eigen::VectorXd& setpoints = controller.setpoints(time);
    Eigen::internal::set_is_malloc_allowed(true);
    counting = false;
    for (double value : setpoints) std::printf("%.17g ", value);
    for (double value : torques) std::printf("%.17g ", value);
    std::puts("");
  }
  return allocations ? 3 : 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
