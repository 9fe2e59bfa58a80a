#include "analysis/diagnose/projection.h"

namespace emtb {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void OwnSums::add(const MatrixPart& s, const MatrixPart& r) {
  readings += static_cast<double>(r.size());
  if (s.size() == 0) return;
  ss += gram(s);
  sr += transposed_product(s, r);
}

void CrossSums::add(const MatrixPart& s, const MatrixPart& c, const MatrixPart& r) {
  cc += gram(c);
  cr += transposed_product(c, r);
  if (s.size() > 0) sc += transposed_product(s, c);
}

void CrossSums::add(const MatrixPart& c, const MatrixPart& products) {
  for (Eigen::Index i = 0; i < c.cols(); ++i) {  // of one or two columns: no product of matrices is as quick
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double sum = c.col(i).dot(c.col(j));
      cc(i, j) += sum;
      if (i != j) cc(j, i) += sum;
    }
  }
  const Eigen::Index known = products.rows() - 1;
  sc += products.topRows(known);
  cr += products.row(known).transpose();
}

MatrixXd imitation(const OwnSums& own, const CrossSums& cross) {
  return own.ss.rows() == 0 ? cross.sc : solve_normal(own.ss, cross.sc);
}

Projected project(const OwnSums& own, const CrossSums& cross, const MatrixXd& imitation) {
  const MatrixXd lost = transposed_product(cross.sc, imitation);
  return {cross.cc - lost - lost.transpose() + transposed_product(imitation, product(own.ss, imitation)),
          cross.cr - transposed_product(imitation, own.sr)};
}

}  // namespace emtb
