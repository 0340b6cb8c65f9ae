// Pinocchio's forward kinematics on CasADi scalars.
//
// Standard input: a model, as `pinocchio.Model.saveToString` writes it. Standard output: the serialised
// `casadi::Function` placements(q) -> (rotations, positions), q (nq,) the configuration, 3 x 3 n and 3 x n of the n
// joints after the universe, one beside the other, in the frame of the model's root [m].

#include <pinocchio/autodiff/casadi.hpp>

#include <pinocchio/algorithm/kinematics.hpp>
#if __has_include(<pinocchio/serialization.hpp>)
  #include <pinocchio/multibody.hpp>
  #include <pinocchio/serialization.hpp>
#else // before version 4
  #include <pinocchio/multibody/model.hpp>
  #include <pinocchio/serialization/model.hpp>
#endif

#include <iostream>
#include <iterator>
#include <string>

int main()
{
  using casadi::SX;
  pinocchio::Model numeric;
  numeric.loadFromString(std::string(std::istreambuf_iterator<char>(std::cin), {}));
  const auto model = numeric.cast<SX>();
  pinocchio::DataTpl<SX> data(model);

  const SX q = SX::sym("q", model.nq);
  Eigen::Matrix<SX, Eigen::Dynamic, 1> configuration(model.nq);
  for (int i = 0; i < model.nq; ++i)
    configuration[i] = q(i);
  pinocchio::forwardKinematics(model, data, configuration);

  SX rotations(3, 3 * (model.njoints - 1)), positions(3, model.njoints - 1);
  for (int joint = 1; joint < model.njoints; ++joint)
    for (int row = 0; row < 3; ++row)
    {
      const auto & placement = data.oMi[joint];
      positions(row, joint - 1) = placement.translation()[row];
      for (int column = 0; column < 3; ++column)
        rotations(row, 3 * (joint - 1) + column) = placement.rotation()(row, column);
    }
  const casadi::Function placements(
    "placements", {q}, {SX::sparsify(rotations), SX::sparsify(positions)}, {"q"}, {"rotations", "positions"});
  std::cout << placements.serialize();
}
