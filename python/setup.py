"""Makes a wheel of what CMake has built: `./run python` calls it in build/python, where the extension stands."""

import os

from setuptools import Distribution, setup


class BinaryDistribution(Distribution):
    """Of this Python and this machine alone."""

    def has_ext_modules(self) -> bool:
        return True


setup(version=os.environ["TRUNDLE_VERSION"], distclass=BinaryDistribution)
