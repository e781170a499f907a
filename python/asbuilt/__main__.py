"""`python -m asbuilt`, the same as `asbuilt`."""

from asbuilt_start import main

if __name__ == "__main__":
    main()
