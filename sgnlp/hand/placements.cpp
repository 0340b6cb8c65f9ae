// Pinocchio's forward kinematics on CasADi scalars.
//
// Standard input: a model, as `pinocchio.Model.saveToString` writes it. Standard output: the serialised
// `casadi::Function` placements(q) -> (rotations, positions), q (nq,) the configuration, 3 x 3 n and 3 x n of the n
// joints after the universe, one beside the other, in the frame of the model's root [m].
//
// Each joint is Pinocchio's, on CasADi scalars; the recursion is that of `pinocchio::forwardKinematics`, which itself
// would need the whole model and its data on CasADi scalars: the compiler would take half as long again.

#include <pinocchio/autodiff/casadi.hpp>

#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>

#include <iostream>
#include <iterator>
#include <string>
#include <vector>

using casadi::SX;
using Place = pinocchio::SE3Tpl<SX>;
using Configuration = Eigen::Matrix<SX, Eigen::Dynamic, 1>;

// Where a joint carries what it moves, in the frame of the joint before: its placement there, and its motion.
struct Moved : boost::static_visitor<Place>
{
  const Place & placement;
  const Configuration & q;

  Moved(const Place & placement, const Configuration & q)
  : placement(placement), q(q)
  {
  }

  template<typename Joint>
  Place operator()(const Joint & numeric) const
  {
    const auto joint = numeric.template cast<SX>();
    auto data = joint.createData();
    joint.calc(data, q);
    return placement * data.M_accessor();
  }

  template<typename Joint>
  Place operator()(const boost::recursive_wrapper<Joint> & numeric) const
  {
    return (*this)(numeric.get());
  }
};

int main()
{
  pinocchio::Model model;
  model.loadFromString(std::string(std::istreambuf_iterator<char>(std::cin), {}));

  const SX q = SX::sym("q", model.nq);
  Configuration configuration(model.nq);
  for (int i = 0; i < model.nq; ++i)
    configuration[i] = q(i);

  std::vector<Place> places(model.njoints, Place::Identity());
  SX rotations(3, 3 * (model.njoints - 1)), positions(3, model.njoints - 1);
  for (int joint = 1; joint < model.njoints; ++joint)
  {
    const Place placement = model.jointPlacements[joint].cast<SX>();
    const Place own = boost::apply_visitor(Moved(placement, configuration), model.joints[joint].toVariant());
    const auto parent = model.parents[joint];
    places[joint] = parent > 0 ? places[parent] * own : own;
    for (int row = 0; row < 3; ++row)
    {
      positions(row, joint - 1) = places[joint].translation()[row];
      for (int column = 0; column < 3; ++column)
        rotations(row, 3 * (joint - 1) + column) = places[joint].rotation()(row, column);
    }
  }
  const casadi::Function placements(
    "placements", {q}, {SX::sparsify(rotations), SX::sparsify(positions)}, {"q"}, {"rotations", "positions"});
  std::cout << placements.serialize();
}
