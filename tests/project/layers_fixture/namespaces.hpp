namespace low {}
namespace high {}
