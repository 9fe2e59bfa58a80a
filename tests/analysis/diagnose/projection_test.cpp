#include "analysis/diagnose/projection.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

using Eigen::MatrixXd;

TEST(CrossSums, AreTheSameWhereTheProductsAreKnown) {
  const MatrixXd s = MatrixXd::Random(50, 4), c = MatrixXd::Random(50, 2), r = MatrixXd::Random(50, 1);
  CrossSums from_readings(4, 2), from_products(4, 2);
  from_readings.add(s, c, r);
  MatrixXd known(50, 5);
  known << s, r;
  from_products.add(c, transposed_product(known, c));
  EXPECT_TRUE(from_products.sc.isApprox(from_readings.sc, 1e-12));
  EXPECT_TRUE(from_products.cc.isApprox(from_readings.cc, 1e-12));
  EXPECT_TRUE(from_products.cr.isApprox(from_readings.cr, 1e-12));
}

}  // namespace
}  // namespace emtb
