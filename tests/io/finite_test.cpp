#include "trundle/io/finite.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::io {
namespace {

using testing::HasSubstr;

std::string fault_of(const char* file, const char* content) {
  try {
    require_finite(file, content);
  } catch (const CannotAnswer& error) {
    return error.what();
  }
  return "none";
}

TEST(RequireFinite, NamesFileColumnAndLine) {
  EXPECT_THAT(fault_of("o/innovations.csv", "# head\ntime_s,landmark,nis\n1,a,2\n2,b,inf\n"),
              HasSubstr("o/innovations.csv: 'nis' would be inf in line 4"));
  EXPECT_THAT(fault_of("t.csv", "time_s,var_xx\n1,-2.4e-14\n"), HasSubstr("'var_xx' would be -2.4e-14"));
  EXPECT_THAT(fault_of("t.csv", "time_s,x_m\n1,-nan"), HasSubstr("'x_m' would be -nan"));
  EXPECT_THAT(fault_of("t.tum", "1 2 nan 0\n"), HasSubstr("nan in line 1"));
  EXPECT_THAT(fault_of("r.toml", "[calibration]\nsigma_m = inf\n"), HasSubstr("'sigma_m' would be inf"));
  EXPECT_THAT(fault_of("r.toml", "covariance = [1.0, -nan]\n"), HasSubstr("-nan"));
}

TEST(RequireFinite, LetsWordsAndNumbersPass) {
  EXPECT_EQ(fault_of("l.csv", "landmark,x_m,var_xx,var_xy\nnan,1,0,-1\ninf,-2,-0,3\n\"a,\"\"inf\",1,2,3\n"),
            "none");
  EXPECT_EQ(fault_of("r.csv", "time_s,x_m,y_m\n1,,\n\n"), "none");
  EXPECT_EQ(fault_of("r.toml", "# ± nan\nname = \"inf\"\nkind = 'nan' # inf\nx_m = 1.0\n"), "none");
  EXPECT_EQ(fault_of("state", "nan,inf"), "none");
}

}  // namespace
}  // namespace trundle::io
