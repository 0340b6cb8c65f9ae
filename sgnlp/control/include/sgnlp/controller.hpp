// Carries out a planned grasp: joint torques from the time, the wrist and the joints, as sgnlp.control does in Python.
//
// A file that sgnlp.control.export wrote has hand, grasp and law. C++17; the headers of Eigen 3.4 are all it needs:
//
//   sgnlp::Controller controller = sgnlp::Controller::load("grasp.txt");
//   controller.torques(time, wrist, joints, speeds);  // in each cycle; nothing is allocated
//
// Joints are in the order of names(). Frames, units and equations: docs/pages/howto/controller.md.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <istream>
#include <locale>
#include <stdexcept>
#include <string>
#include <vector>

namespace sgnlp {

class Controller {
 public:
  using Vector = Eigen::VectorXd;
  using Input = Eigen::Ref<const Eigen::VectorXd>;

  // Throws std::runtime_error where the file is not there or is none.
  static Controller load(const std::string& file) {
    std::ifstream stream(file);
    if (!stream) throw std::runtime_error("sgnlp: cannot read '" + file + "'");
    return Controller(stream);
  }

  explicit Controller(std::istream& stream) {
    stream.imbue(std::locale::classic());
    read(stream);
    prepare();
  }

  // The hand's own joints, n of them, in the order of all arrays; the fingers, m of them.
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<std::string>& fingers() const { return finger_names_; }
  const Vector& effort() const { return effort_; }
  // The pregrasp: pose of the root link in the world, x y z [m] qx qy qz qw, and the joints (n) [rad].
  const Vector& wrist() const { return wrist_; }
  const Vector& pregrasp() const { return pregrasp_; }

  // The setpoints at a time [s] from the begin of closing: of the tips (3m) [m] in the frame of the root link, finger by
  // finger, or of the joints (n) [rad] under position control.
  const Vector& setpoints(double time) {
    if (time < 0.0)
      setpoints_ = begin_;
    else if (time >= seconds_)
      setpoints_ = end_;
    else
      setpoints_ = begin_ + time / seconds_ * (end_ - begin_);
    return setpoints_;
  }

  // The torques (n) [N m] at a time [s] from the begin of closing, with the orientation of the root link in the world,
  // joints (n) [rad] and their speeds (n) [rad/s]. They stand until the next call.
  // Throws std::invalid_argument where there are more or fewer than n, or the quaternion is not of norm 1.
  const Vector& torques(double time, const Eigen::Quaterniond& wrist, const Input& joints, const Input& speeds) {
    if (joints.size() != own() || speeds.size() != own())
      throw std::invalid_argument("sgnlp: joints and speeds must be " + std::to_string(own()) + " numbers");
    if (!(std::abs(wrist.norm() - 1.0) <= norm_off))
      throw std::invalid_argument("sgnlp: the wrist's quaternion must have norm 1, not " +
                                  std::to_string(wrist.norm()));
    place(joints);
    setpoints(time);
    if (position_)
      torques_ = stiffness_ * (setpoints_ - joints) - critical(stiffness_, joint_inertia_) * speeds;
    else
      pull(joints, speeds);
    bear(wrist.normalized().conjugate() * gravity_);
    for (int i = 0; i < own(); ++i) torques_[i] = std::clamp(torques_[i], -effort_[i], effort_[i]);
    return torques_;
  }

 private:
  using Vector3 = Eigen::Vector3d;
  using Matrix3 = Eigen::Matrix3d;
  using Matrix = Eigen::MatrixXd;

  struct Joint {
    int parent;  // -1: the root link
    int own;     // the joint of the hand's own that it is or follows, at multiplier * q + offset
    double multiplier, offset;
    bool prismatic;
    Matrix3 rotation;  // of its frame at zero in its parent's
    Vector3 translation, axis;
    double mass;  // of all links that it carries up to the next joints
    Vector3 centre;
    // where it is, in the frame of the root link
    Matrix3 turn;
    Vector3 place, along;
    double carried;  // mass [kg] of it and all that follows
    Vector3 moment;  // mass times centre [kg m]
  };

  struct Tip {
    int joint;
    Vector3 offset;
    double gain, damping;
  };

  static constexpr double norm_off = 1e-3;  // by which a quaternion's norm may be off 1, as in Python

  static double critical(double stiffness, double inertia) { return 2.0 * std::sqrt(stiffness * inertia); }
  int own() const { return static_cast<int>(names_.size()); }

  void place(const Input& joints) {
    for (Joint& joint : joints_) {
      const double q = joint.multiplier * joints[joint.own] + joint.offset;
      joint.turn = joint.rotation;
      joint.place = joint.translation;
      if (joint.parent >= 0) {
        const Joint& parent = joints_[joint.parent];
        joint.turn = parent.turn * joint.rotation;
        joint.place = parent.place + parent.turn * joint.translation;
      }
      joint.along = joint.turn * joint.axis;
      if (joint.prismatic)
        joint.place += q * joint.along;
      else
        joint.turn = joint.turn * Eigen::AngleAxisd(q, joint.axis);
    }
  }

  // Springs from the tips to their setpoints, and the posture in what these leave free.
  void pull(const Input& joints, const Input& speeds) {
    jacobian_.setZero();
    for (int i = 0; i < static_cast<int>(tips_.size()); ++i) {
      const Joint& last = joints_[tips_[i].joint];
      const Vector3 tip = last.place + last.turn * tips_[i].offset;
      for (int j = tips_[i].joint; j >= 0; j = joints_[j].parent) {
        const Joint& joint = joints_[j];
        const Vector3 motion = joint.prismatic ? joint.along : Vector3(joint.along.cross(tip - joint.place));
        jacobian_.block<3, 1>(3 * i, joint.own) += joint.multiplier * motion;
      }
      forces_.segment<3>(3 * i) = tips_[i].gain * (setpoints_.segment<3>(3 * i) - tip);
      forces_.segment<3>(3 * i).noalias() -= tips_[i].damping * (jacobian_.middleRows<3>(3 * i) * speeds);
    }
    torques_.noalias() = jacobian_.transpose() * forces_;
    if (posture_ == 0.0) return;
    free_ = posture_ * (contact_ - joints) - critical(posture_, joint_inertia_) * speeds;
    square_.noalias() = jacobian_ * jacobian_.transpose();
    square_.diagonal().array() += free_length_ * free_length_;
    solver_.compute(square_);
    forces_.noalias() = jacobian_ * free_;
    solver_.solveInPlace(forces_);
    free_.noalias() -= jacobian_.transpose() * forces_;
    torques_ += free_;
  }

  // The weight of the links, with gravity in the frame of the root link.
  void bear(const Vector3& gravity) {
    for (Joint& joint : joints_) {
      joint.carried = joint.mass;
      joint.moment = joint.mass * (joint.place + joint.turn * joint.centre);
    }
    for (auto joint = joints_.rbegin(); joint != joints_.rend(); ++joint) {
      if (joint->parent >= 0) {
        joints_[joint->parent].carried += joint->carried;
        joints_[joint->parent].moment += joint->moment;
      }
      const Vector3 motion = joint->prismatic
                                 ? Vector3(joint->carried * joint->along)
                                 : Vector3(joint->along.cross(joint->moment - joint->carried * joint->place));
      torques_[joint->own] -= joint->multiplier * gravity.dot(motion);
    }
  }

  // --- the file: words and numbers in one order ---------------------------------------------------------------------

  void read(std::istream& in) {
    expect(in, "sgnlp-controller");
    if (number(in) != 1.0) throw std::runtime_error("sgnlp: a file of another version");
    expect(in, "law");
    std::string law;
    in >> law;
    position_ = law == "position";
    if (!position_ && law != "impedance") throw std::runtime_error("sgnlp: unknown law '" + law + "'");
    expect(in, "gravity");
    gravity_ = numbers(in, 3);
    const double tip_mass = value(in, "tip_mass");
    joint_inertia_ = value(in, "joint_inertia");
    free_length_ = value(in, "free_length");
    seconds_ = value(in, "seconds");
    posture_ = value(in, "posture");
    stiffness_ = value(in, "joint_stiffness");
    joints_.resize(count(in, "joints"));
    for (Joint& joint : joints_) joint = read_joint(in);
    names_.resize(count(in, "own"));
    effort_.resize(own());
    for (int i = 0; i < own(); ++i) effort_[i] = number(in), names_[i] = name(in);
    tips_.resize(count(in, "fingers"));
    for (Tip& tip : tips_) {
      tip.joint = static_cast<int>(number(in));
      tip.offset = numbers(in, 3);
      tip.gain = number(in);
      tip.damping = critical(tip.gain, tip_mass);
      finger_names_.push_back(name(in));
    }
    const int size = position_ ? own() : 3 * static_cast<int>(tips_.size());
    wrist_ = labelled(in, "wrist", 7);
    pregrasp_ = labelled(in, "pregrasp", own());
    contact_ = labelled(in, "contact", own());
    begin_ = labelled(in, "begin", size);
    end_ = labelled(in, "end", size);
  }

  static Joint read_joint(std::istream& in) {
    Joint joint{};
    joint.parent = static_cast<int>(number(in));
    joint.own = static_cast<int>(number(in));
    joint.multiplier = number(in);
    joint.offset = number(in);
    joint.prismatic = number(in) != 0.0;
    const Vector turn = numbers(in, 9);
    joint.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn.data());
    joint.translation = numbers(in, 3);
    joint.axis = numbers(in, 3);
    joint.mass = number(in);
    joint.centre = numbers(in, 3);
    name(in);
    return joint;
  }

  void prepare() {
    const int n = own(), rows = 3 * static_cast<int>(tips_.size());
    for (int j = 0; j < static_cast<int>(joints_.size()); ++j)
      if (joints_[j].parent >= j || joints_[j].own < 0 || joints_[j].own >= n)
        throw std::runtime_error("sgnlp: a joint of the file follows or is carried by one that is not there");
    for (const Tip& tip : tips_)
      if (tip.joint < 0 || tip.joint >= static_cast<int>(joints_.size()))
        throw std::runtime_error("sgnlp: a finger of the file ends on a joint that is not there");
    setpoints_ = begin_;
    torques_.setZero(n);
    free_.setZero(n);
    forces_.setZero(rows);
    jacobian_.setZero(rows, n);
    square_.setZero(rows, rows);
    solver_ = Eigen::LLT<Matrix>(rows);
  }

  static void expect(std::istream& in, const std::string& word) {
    std::string found;
    if (!(in >> found) || found != word)
      throw std::runtime_error("sgnlp: no file of a controller: '" + word + "' is missing, there is '" + found + "'");
  }

  static double number(std::istream& in) {
    double value = 0.0;
    if (!(in >> value)) throw std::runtime_error("sgnlp: the file of the controller ends early, or a number is none");
    return value;
  }

  static Vector numbers(std::istream& in, int size) {
    Vector values(size);
    for (double& value : values) value = number(in);
    return values;
  }

  static double value(std::istream& in, const std::string& word) { return expect(in, word), number(in); }
  static int count(std::istream& in, const std::string& word) { return static_cast<int>(value(in, word)); }
  static Vector labelled(std::istream& in, const std::string& word, int size) {
    return expect(in, word), numbers(in, size);
  }

  static std::string name(std::istream& in) {  // the rest of the line
    std::string text;
    std::getline(in >> std::ws, text);
    return text;
  }

  bool position_ = false;
  Vector3 gravity_;
  double joint_inertia_ = 0.0, free_length_ = 0.0, seconds_ = 0.0, posture_ = 0.0, stiffness_ = 0.0;
  std::vector<Joint> joints_;  // each after the one that carries it
  std::vector<Tip> tips_;
  std::vector<std::string> names_, finger_names_;
  Vector effort_, wrist_, pregrasp_, contact_, begin_, end_;
  // room for a cycle
  Vector setpoints_, torques_, free_, forces_;
  Matrix jacobian_, square_;
  Eigen::LLT<Matrix> solver_;
};

}  // namespace sgnlp
