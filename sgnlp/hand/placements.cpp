// Pinocchio's forward kinematics on CasADi scalars.
//
// Standard input: the number of coordinates and that of the joints after the universe, then each of these joints, as
// `sgnlp.hand.placement_functions` writes it: its parent, its coordinate, whether it mimics another, what multiplies the
// coordinate and what is added to it, whether it turns, its axis, and its placement in its parent's frame (rotation by
// rows, translation). Standard output: the serialised `casadi::Function` placements(q) -> (rotations, positions), q (nq,)
// the configuration, 3 x 3 n and 3 x n of the n joints, one beside the other, in the frame of the model's root [m].
//
// Each joint is Pinocchio's, on CasADi scalars; the recursion is that of `pinocchio::forwardKinematics`. The whole model
// on CasADi scalars, or read as Pinocchio writes it, would take the compiler ten times as long.

#include <pinocchio/autodiff/casadi.hpp>

#include <pinocchio/multibody/joint.hpp>

#include <iostream>
#include <vector>

using casadi::SX;
using Place = pinocchio::SE3Tpl<SX>;
using Coordinate = Eigen::Matrix<SX, 1, 1>;
using Axis = Eigen::Vector3d;

// A joint as the input has it.
struct Described
{
  int parent, coordinate;
  double mimics, factor, offset, turns;
  Axis axis;
  Place placement;
};

// Where a joint carries what it moves, in the frame of the joint before: its placement there, and its motion.
template<typename Joint>
Place placed(const Described & it, Joint joint, const Coordinate & q)
{
  joint.setIndexes(1, 0, 0);
  auto data = joint.createData();
  joint.calc(data, q);
  if (it.mimics) // whose motion Pinocchio keeps as any other placement
    return it.placement * Place(data.M_accessor());
  return it.placement * data.M_accessor();
}

// By the joint of its kind, which knows the zeros of an axis of the frame.
template<template<typename, int, int> class Aligned, template<typename, int> class Skew>
Place moved(const Described & it, const Coordinate & q)
{
  if (it.axis == Axis::UnitX())
    return placed(it, Aligned<SX, 0, 0>(), q);
  if (it.axis == Axis::UnitY())
    return placed(it, Aligned<SX, 0, 1>(), q);
  if (it.axis == Axis::UnitZ())
    return placed(it, Aligned<SX, 0, 2>(), q);
  Skew<SX, 0> joint;
  joint.axis = it.axis.cast<SX>();
  return placed(it, joint, q);
}

template<int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> read()
{
  Eigen::Matrix<double, Rows, Columns> matrix;
  for (int row = 0; row < Rows; ++row)
    for (int column = 0; column < Columns; ++column)
      std::cin >> matrix(row, column);
  return matrix;
}

Described next()
{
  Described it;
  std::cin >> it.parent >> it.coordinate >> it.mimics >> it.factor >> it.offset >> it.turns;
  it.axis = read<3, 1>();
  const Eigen::Matrix3d rotation = read<3, 3>();
  it.placement = pinocchio::SE3(rotation, read<3, 1>()).cast<SX>();
  return it;
}

int main()
{
  int coordinates, joints;
  std::cin >> coordinates >> joints;
  const SX q = SX::sym("q", coordinates);
  std::vector<Place> places(joints + 1, Place::Identity());
  SX rotations(3, 3 * joints), positions(3, joints);
  for (int joint = 0; joint < joints; ++joint)
  {
    const Described it = next();
    if (!std::cin)
    {
      std::cerr << "the model cannot be read";
      return 1;
    }
    const Coordinate at(SX(it.factor) * q(it.coordinate) + SX(it.offset));
    const Place own =
      it.turns ? moved<pinocchio::JointModelRevoluteTpl, pinocchio::JointModelRevoluteUnalignedTpl>(it, at)
               : moved<pinocchio::JointModelPrismaticTpl, pinocchio::JointModelPrismaticUnalignedTpl>(it, at);
    Place & place = places[joint + 1];
    place = it.parent > 0 ? places[it.parent] * own : own;
    for (int row = 0; row < 3; ++row)
    {
      positions(row, joint) = place.translation()[row];
      for (int column = 0; column < 3; ++column)
        rotations(row, 3 * joint + column) = place.rotation()(row, column);
    }
  }
  const casadi::Function placements(
    "placements", {q}, {SX::sparsify(rotations), SX::sparsify(positions)}, {"q"}, {"rotations", "positions"});
  std::cout << placements.serialize();
}
