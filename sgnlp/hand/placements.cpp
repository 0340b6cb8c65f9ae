// Pinocchio's forward kinematics on CasADi scalars.
//
// Standard input: the number of coordinates, that of the joints after the universe, and that of the rows. A row is a
// joint, or a part of a composite one, as `sgnlp.hand.placement_functions` writes it: the row of its parent (0: the
// root), its coordinate, whether it is the last part of its joint, whether it mimics another, whether it turns, what
// multiplies the coordinate and what is added to it, its axis, and its placement in its parent's frame (rotation by
// rows, translation). Standard output: the serialised `casadi::Function` placements(q) -> (rotations, positions), q
// (nq,) the configuration, 3 x 3 n and 3 x n of the n joints, one beside the other, in the frame of the model's root
// [m].
//
// Each joint is Pinocchio's, on CasADi scalars; the recursion is that of `pinocchio::forwardKinematics`. The whole
// model on CasADi scalars, or read as Pinocchio writes it, would take the compiler ten times as long.

#include <pinocchio/autodiff/casadi.hpp>

#include <pinocchio/multibody/joint.hpp>

#include <iostream>
#include <vector>

using casadi::SX;
using Place = pinocchio::SE3Tpl<SX>;
using Coordinate = Eigen::Matrix<SX, 1, 1>;
using Axis = Eigen::Vector3d;

// A row of the input.
struct Described
{
  int parent, coordinate;
  bool last, mimics, turns;
  double factor, offset;
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
  std::cin >> it.parent >> it.coordinate >> it.last >> it.mimics >> it.turns >> it.factor >> it.offset;
  it.axis = read<3, 1>();
  const Eigen::Matrix3d rotation = read<3, 3>();
  it.placement = pinocchio::SE3(rotation, read<3, 1>()).cast<SX>();
  return it;
}

int main()
{
  int coordinates, joints, rows;
  std::cin >> coordinates >> joints >> rows;
  const SX q = SX::sym("q", coordinates);
  std::vector<Place> places(rows + 1, Place::Identity());
  SX rotations(3, 3 * joints), positions(3, joints);
  for (int row = 1, joint = 0; row <= rows; ++row)
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
    places[row] = it.parent > 0 ? places[it.parent] * own : own;
    if (!it.last)
      continue;
    for (int i = 0; i < 3; ++i)
    {
      positions(i, joint) = places[row].translation()[i];
      for (int j = 0; j < 3; ++j)
        rotations(i, 3 * joint + j) = places[row].rotation()(i, j);
    }
    ++joint;
  }
  const casadi::Function placements(
    "placements", {q}, {SX::sparsify(rotations), SX::sparsify(positions)}, {"q"}, {"rotations", "positions"});
  std::cout << placements.serialize();
}
