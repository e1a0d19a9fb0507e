mod path;
mod spline;
