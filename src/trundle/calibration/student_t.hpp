#pragma once

namespace trundle {

/// t with P(|T| ≤ t) = 0.95 for Student's distribution; error below 1e-5. At least one degree of freedom.
double student_t_95(int degrees_of_freedom);

}  // namespace trundle
